# SPDX-License-Identifier: MIT
"""Hundreds of cycles with every fault: fewer answers, but never a wrong or an old one.

The emulated motors turn at a known speed, so that each position tells when it was measured. An
answer is right when that was between the question and the answer.
"""

from __future__ import annotations

import time

import numpy as np
import pytest

from hardware.emulate.motor import Motion
from hardware.emulate.servos import ServoLineEmulator
from hardware.servo.bus import Bus
from hardware.servo.safety import MAX_MISSES
from hardware.servo.state import StateTracker
from hardware.servo.table import STATE

CYCLES = 120
SPEED = 10_000  # [ticks/s]: 1 ms is 10 ticks
EARLY, LATE = 0.003, 0.001  # [s], rounding
DRIFT = 0.03  # of the time since the last answer, what a servo's clock may be wrong by


class Turning:
    """Motors whose position is the time, each with its own offset."""

    def __init__(self):
        self.start = time.monotonic()

    def position(self, servo_id, now):
        return SPEED * (now - self.start) + 100 * servo_id

    def measured_at(self, servo_id, position):
        return self.start + (position - 100 * servo_id) / SPEED

    def advance(self, dt, drives):
        now = time.monotonic()
        return {i: Motion(self.position(i, now), SPEED) for i in drives}


@pytest.fixture
def line(description):
    ids = [joint.id for joint in description.joints]
    with ServoLineEmulator(ids, plant=Turning()) as emulator:
        yield emulator


def run(line, description, cycles=CYCLES):
    """Share of answers that came, after checking that each was right."""
    joints = description.joints
    tracker = StateTracker(joints, description.check_clocks)
    came = 0
    ways = np.zeros(len(joints))  # [s], of each servo's fastest answer, which bounds its clock
    with Bus(line.path, 1_000_000) as bus:
        for _ in range(cycles):
            ages = np.array([tracker.age(k, time.monotonic()) for k in range(len(joints))])
            # With nothing to compare with, or after a silence at which the hand would have stopped,
            # a servo's clock cannot tell.
            comparable = np.isfinite(ages) & (tracker.misses < MAX_MISSES)
            read = bus.sync_read([joint.id for joint in joints], STATE)
            state = tracker.update(read)
            for k in np.flatnonzero((state.ages == 0) & comparable):
                servo_id = joints[k].id
                ticks = joints[k].ticks(state.positions[k], tracker.turns[k])
                ticks += 4096 * line.servos[servo_id].turns
                measured = line.plant.measured_at(servo_id, ticks)
                early = EARLY + DRIFT * ages[k] + ways[k]
                assert read.start - early < measured < read.end + LATE, "not made when asked"
                way = read.answers[servo_id].arrived - measured
                ways[k] = min(ways[k], way) if ways[k] else way
                came += 1
    assert not tracker.restarted.any()
    return came / (cycles * len(joints))


@pytest.mark.parametrize(
    "faults",
    [
        {},
        {"drop": 0.01},
        {"corrupt": 0.01},
        {"truncate": 0.01},
        {"garbage": 0.05},
        {"duplicate": 0.05},
        {"lost_instruction": 0.05},
        {"echo": True},
        {"delay": 0.005, "delay_time": 0.010},
        {"delay": 0.005, "delay_time": 0.030},
        {"delay": 0.005, "delay_time": 0.070},
        {"drop": 0.005, "corrupt": 0.005, "truncate": 0.005, "garbage": 0.005}
        | {"duplicate": 0.005, "delay": 0.002, "lost_instruction": 0.01, "echo": True},
    ],
    ids=lambda faults: "+".join(faults) or "none",
)
def test_no_answer_is_wrong_or_old(line, description, faults):
    for name, value in faults.items():
        setattr(line.faults, name, value)
    assert run(line, description) > 0.3  # of all answers came: there was something to see


def test_old_answers_would_be_taken_without_the_servos_clocks(line, description):
    """The check above can fail: where a hub stalls, only the clocks tell old answers from new."""
    line.faults.delay, line.faults.delay_time = 0.02, 0.04
    with pytest.raises(AssertionError, match="not made when asked"):
        run(line, description.model_copy(update={"check_clocks": False}), cycles=2000)
