# SPDX-License-Identifier: MIT
"""Hundreds of cycles with every fault: fewer answers, but never a wrong or an old one.

The emulated motors turn at a known speed, so that each position tells when it was measured. An
answer is right when that was between the question and the answer.
"""

from __future__ import annotations

import time

import pytest

from hardware.emulate.motor import Motion
from hardware.emulate.servos import ServoLineEmulator
from hardware.servo.bus import Bus
from hardware.servo.guard import MAX_MISSES
from hardware.servo.state import STATE, StateTracker

CYCLES = 200
SPEED = 10_000  # [ticks/s]: 1 ms is 10 ticks
EARLY = 0.008  # [s], what the servos' clocks may drift in five cycles; old answers are older
LATE = 0.001  # [s], rounding


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
    with Bus(line.path, 1_000_000) as bus:
        for _ in range(cycles):
            given_up = tracker.misses >= MAX_MISSES  # the hand would have stopped
            read = bus.sync_read([joint.id for joint in joints], STATE)
            state = tracker.update(read)
            answered = (state.ages == 0) & ~given_up
            for joint, angle, counts in zip(joints, state.positions, answered, strict=True):
                if counts:
                    measured = line.plant.measured_at(joint.id, joint.ticks(angle))
                    assert read.start - EARLY < measured < read.end + LATE, (
                        "not measured when asked"
                    )
                    came += 1
    assert not tracker.restarted.any()
    return came / (cycles * len(joints))


@pytest.mark.parametrize(
    ("faults", "share"),
    [
        ({}, 0.95),
        ({"drop": 0.01}, 0.9),
        ({"corrupt": 0.01}, 0.9),
        ({"truncate": 0.01}, 0.9),
        ({"garbage": 0.05}, 0.9),
        ({"duplicate": 0.05}, 0.9),
        ({"lost_instruction": 0.05}, 0.85),
        ({"echo": True}, 0.95),
        ({"delay": 0.005, "delay_time": 0.010}, 0.8),
        ({"delay": 0.005, "delay_time": 0.030}, 0.5),
        ({"delay": 0.005, "delay_time": 0.070}, 0.3),
        (
            {"drop": 0.005, "corrupt": 0.005, "truncate": 0.005, "garbage": 0.005}
            | {"duplicate": 0.005, "delay": 0.002, "lost_instruction": 0.01, "echo": True},
            0.7,
        ),
    ],
    ids=lambda value: "+".join(value) if isinstance(value, dict) else None,
)
def test_no_answer_is_wrong_or_old(line, description, faults, share):
    for name, value in faults.items():
        setattr(line.faults, name, value)
    assert run(line, description) > share


def test_old_answers_would_be_taken_without_the_servos_clocks(line, description):
    """The check above can fail: where a hub stalls, only the clocks tell old answers from new."""
    line.faults.delay, line.faults.delay_time = 0.02, 0.04
    with pytest.raises(AssertionError, match="not measured when asked"):
        run(line, description.model_copy(update={"check_clocks": False}), cycles=2000)
