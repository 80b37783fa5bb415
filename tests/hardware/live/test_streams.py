# SPDX-License-Identifier: MIT
from __future__ import annotations

import pytest

from hardware.live.streams import CAPACITY, RunClock, Streams


@pytest.fixture
def streams():
    return Streams(("joints", "vision"))


def test_a_stream_holds_its_last_value_at_or_before_an_instant(streams):
    for instant in (10, 20, 30):
        streams.put("joints", instant, instant)
    held = [streams.held("joints", instant) for instant in (9, 10, 29, 30, 99)]
    assert [sample and sample.value for sample in held] == [None, 10, 20, 30, 30]


def test_samples_out_of_order_are_refused_and_counted(streams):
    assert streams.put("joints", 20, "new")
    assert not streams.put("joints", 20, "again")
    assert not streams.put("joints", 10, "old")
    assert streams.latest("joints").value == "new"
    assert streams.refused() == {"joints": 2, "vision": 0}


def test_what_was_fused_does_not_change_any_more(streams):
    streams.put("joints", 10, "early")
    before = streams.seal(15)
    recorded = []
    assert not streams.put("joints", 12, "late", lambda: recorded.append("late"))
    assert not streams.put("vision", 15, "late", lambda: recorded.append("late"))
    assert streams.seal(15) == before
    assert recorded == []  # nor is it in the recording
    assert streams.put("vision", 16, "next", lambda: recorded.append("next"))
    assert recorded == ["next"]


def test_ages_count_from_the_newest_sample(streams):
    assert streams.age("joints", 5) == float("inf")
    streams.put("joints", 1_000_000_000, None)
    assert streams.age("joints", 1_250_000_000) == pytest.approx(0.25)


def test_memory_stays_bounded(streams):
    for instant in range(3 * CAPACITY):
        streams.put("joints", instant, instant)
    assert streams.held("joints", 2 * CAPACITY - 1) is None
    assert streams.held("joints", 2 * CAPACITY).value == 2 * CAPACITY
    assert streams.count("joints") == 3 * CAPACITY


def test_the_run_clock_counts_nanoseconds_since_the_run_began():
    clock = RunClock(lambda: 1000.5)
    assert clock.now_ns() == 0
    assert clock.instant_ns(1001.0) == 500_000_000
    assert clock.instant_ns(1000.0) == -500_000_000
