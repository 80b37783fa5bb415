# SPDX-License-Identifier: MIT
from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from hardware.servo.safety import MAX_MISSES
from hardware.servo.state import Freshness, ServoClock

FRESH, STALE, RESTARTED = Freshness.FRESH, Freshness.STALE, Freshness.RESTARTED
CYCLE, LENGTH = 0.02, 0.005  # [s]
OFFSET = 100.0  # [s], between the servo's clock and ours


def tick(age):
    return int(age * 1000) % 32768


def run(clock, cycles, made, rate=1.0, travel=0.001):
    """Freshness of answers ``made(cycle)`` at our time, one a cycle, each in its transaction."""
    return [
        clock.check(
            tick(rate * made(k) + OFFSET), k * CYCLE, max(made(k) + travel, k * CYCLE + travel)
        )
        for k in range(cycles)
    ]


@pytest.mark.parametrize("rate", [0.971, 1.0, 1.029])
@pytest.mark.parametrize("within", [0.0, 0.5, 1.0])
def test_answers_made_within_their_transaction_are_fresh(rate, within):
    freshness = run(ServoClock(), 3000, lambda k: k * CYCLE + within * LENGTH, rate)
    assert set(freshness) == {FRESH}  # 60 s: past a turn of the tick


@given(st.lists(st.tuples(st.floats(0, 0.03), st.floats(0, 0.5)), min_size=30, max_size=30))
@settings(max_examples=50, deadline=None)
def test_neither_when_it_was_made_nor_how_long_it_travelled_makes_an_answer_stale(times):
    clock, asked = ServoClock(), 0.0
    for thought, travel in times:
        made = asked + thought
        assert clock.check(tick(made + OFFSET), asked, made + travel) is FRESH
        asked = made + travel


@pytest.mark.parametrize("rate", [0.971, 1.0, 1.029])
def test_answers_of_the_cycle_before_stay_stale_until_the_hand_gives_up(rate):
    late = run(ServoClock(), 10 + MAX_MISSES, lambda k: (k - (k >= 10)) * CYCLE, rate)
    assert late == [FRESH] * 10 + [STALE] * MAX_MISSES


def test_a_late_answer_is_stale_and_the_next_good_one_is_fresh_again():
    freshness = run(ServoClock(), 20, lambda k: (k - (k == 10)) * CYCLE)
    assert freshness == [FRESH] * 10 + [STALE] + [FRESH] * 9


def test_an_old_answer_is_stale_however_long_its_transaction_took():
    clock = ServoClock()
    run(clock, 10, lambda k: k * CYCLE)
    assert clock.check(tick(0.19 + OFFSET), 0.20, 0.26) is STALE
    assert clock.check(tick(0.21 + OFFSET), 0.20, 0.26) is FRESH


def test_after_a_late_first_answer_old_ones_are_still_noticed():
    late = run(ServoClock(), 20, lambda k: (k - (k in (0, 10))) * CYCLE)
    assert late == [FRESH] * 10 + [STALE] + [FRESH] * 9


def test_a_servo_that_begins_to_count_anew_has_restarted():
    clock = ServoClock()
    assert run(clock, 10, lambda k: k * CYCLE) == [FRESH] * 10
    assert clock.check(tick(0.01), 0.40, 0.401) is RESTARTED
    assert clock.check(tick(0.03), 0.42, 0.421) is RESTARTED
    clock.forget()
    assert clock.check(tick(0.05), 0.44, 0.441) is FRESH


def test_after_a_long_pause_the_clock_is_taken_anew():
    clock = ServoClock()
    clock.check(0, 0.0, 0.001)
    assert clock.check(12345, 20.0, 20.001) is FRESH
