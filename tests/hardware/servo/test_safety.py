# SPDX-License-Identifier: MIT
from __future__ import annotations

import pytest

from hardware.servo.bus import Answer, SyncRead
from hardware.servo.description import load_description
from hardware.servo.safety import MAX_LOST_GOALS, MAX_MISSES, Guard
from hardware.servo.state import StateTracker
from hardware.servo.table import STATE

HAND = load_description("isyhand")
JOINTS = HAND.joints[4:6]  # servos 13 and 12
HAND = HAND.model_copy(update={"joints": JOINTS})
CYCLE = 0.02  # [s]


class Watch:
    """A guard fed with made-up cycles."""

    def __init__(self):
        self.guard, self.tracker = Guard(HAND), StateTracker(JOINTS, check_clocks=True)
        self.now = 100.0

    def cycle(self, ids=(13, 12), sent=None, alert=(), **values):
        self.now += CYCLE
        normal = dict.fromkeys(STATE.names, 0)
        normal |= {"present_position": 2048, "goal_position": 2048, "present_temperature": 30}
        normal["realtime_tick"] = int(self.now * 1000) % 32768
        answers = {i: Answer(normal | values, i in alert, self.now + 0.001) for i in ids}
        read = SyncRead(self.now, self.now + 0.002, answers)
        return self.guard.judge(read, self.tracker.update(read), self.tracker, sent or {})


@pytest.fixture
def watch():
    return Watch()


def test_good_cycles_are_no_trouble(watch):
    assert not any(watch.cycle(sent={13: 2048}) for _ in range(100))


def test_silence_is_trouble_after_five_cycles_in_a_row(watch):
    watch.cycle()
    for _ in range(MAX_MISSES - 1):
        assert not watch.cycle(ids=[13])
    assert not watch.cycle()
    for _ in range(MAX_MISSES - 1):
        assert not watch.cycle(ids=[13])
    assert watch.cycle(ids=[13]).silent == [JOINTS[1]]


def test_an_alert_is_trouble_at_once(watch):
    assert watch.cycle(alert=[12]).alerts == [JOINTS[1]]


def test_a_goal_that_does_not_arrive_is_trouble_in_the_third_cycle(watch):
    for _ in range(MAX_LOST_GOALS - 1):
        assert not watch.cycle(sent={13: 2100})
    assert watch.cycle(sent={13: 2100}).disobedient == [JOINTS[0]]


def test_cycles_without_an_answer_say_nothing_about_goals(watch):
    watch.cycle(sent={13: 2048})
    for _ in range(MAX_MISSES - 1):
        assert not watch.cycle(ids=[12], sent={13: 2100})
    assert not watch.cycle(sent={13: 2048})


def test_heat_is_trouble(watch):
    assert not watch.cycle(present_temperature=67)
    assert "hotter than 68" in watch.cycle(present_temperature=68).reasons[0]


def test_a_servo_that_starts_anew_is_trouble(watch):
    watch.cycle()
    assert "restarted by itself" in watch.cycle(realtime_tick=12).reasons[0]
