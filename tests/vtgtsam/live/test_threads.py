# SPDX-License-Identifier: MIT
from __future__ import annotations

import threading

import pytest

from vtgtsam.live.threads import Ticker


class FakeClock:
    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now


@pytest.fixture
def clock():
    return FakeClock()


def test_deadlines_lie_on_a_grid_however_late_each_tick_is(clock):
    ticker = Ticker(50.0, clock)
    for k in range(200):
        clock.now = max(clock.now, 100.0 + k * 0.02) + 0.007  # always 7 ms late
        ticker.take()
        assert ticker.remaining() == pytest.approx(0.013)
    assert (ticker.ticks, ticker.missed) == (200, 0)


def test_missed_deadlines_are_counted_and_not_made_up_for(clock):
    ticker = Ticker(50.0, clock)
    ticker.take()
    clock.now += 0.105  # five periods: of the deadlines at 20, 40, 60, 80 and 100 ms one is taken
    assert ticker.remaining() == 0.0
    ticker.take()
    assert ticker.missed == 4
    assert ticker.remaining() == pytest.approx(0.015)


def test_a_set_stop_ends_the_wait_at_once():
    stop = threading.Event()
    ticker = Ticker(0.01)
    assert ticker.wait(stop)  # the first deadline is now
    stop.set()
    assert not ticker.wait(stop)
    assert ticker.ticks == 1


def test_a_rate_that_is_not_positive_is_refused():
    with pytest.raises(ValueError, match="rate must be above 0 Hz, got 0"):
        Ticker(0)
