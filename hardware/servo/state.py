# SPDX-License-Identifier: MIT
"""What is known of the joints after each cycle: the last good answer of every servo and its age."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum

import numpy as np

from hardware.device import HandState

from .bus import Answer, SyncRead
from .description import Joint
from .table import to_si


class StateTracker:
    """Turns sync reads into states.

    Attributes:
        misses: How many cycles in a row each joint has had no good answer, shape (J,).
        restarted: Whether each joint's servo has restarted unasked, shape (J,).
        goals: Goal position each servo last reported [ticks], by servo id.
        turns: Whole turns by which each joint's servo counts more than the hand's file, shape (J,).
    """

    def __init__(self, joints: Sequence[Joint], check_clocks: bool) -> None:
        self._joints = tuple(joints)
        self._names = tuple(joint.name for joint in joints)
        self._clocks = [ServoClock() for _ in joints] if check_clocks else None
        self._values = np.full((5, len(joints)), np.nan)
        self._answered = np.full(len(joints), -np.inf)
        self.misses = np.zeros(len(joints), dtype=int)
        self.restarted = np.zeros(len(joints), dtype=bool)
        self.goals: dict[int, int] = {}
        self.turns = np.zeros(len(joints), dtype=int)

    def forget_clocks(self) -> None:
        """The servos may have been restarted on purpose."""
        self.restarted[:] = False
        for clock in self._clocks or ():
            clock.forget()

    def update(self, read: SyncRead) -> HandState:
        """Take over one cycle's answers."""
        for index, joint in enumerate(self._joints):
            answer = read.answers.get(joint.id)
            if answer is None or not self._fresh(index, answer, read.start):
                self.misses[index] += 1
                continue
            self.misses[index] = 0
            self._answered[index] = read.time
            self.goals[joint.id] = answer.values["goal_position"]
            self.turns[index] = joint.turns(answer.values["present_position"])
            self._values[:, index] = _in_si(joint, answer.values)
        return self._state(read.time)

    def age(self, index: int, now: float) -> float:
        """How long ago a joint last answered [s]."""
        return now - float(self._answered[index])

    def position(self, index: int) -> float:
        """Where a joint last was [rad]; NaN where it never answered."""
        return float(self._values[0, index])

    def _fresh(self, index: int, answer: Answer, asked: float) -> bool:
        if self._clocks is None:
            return True
        tick = answer.values["realtime_tick"]
        freshness = self._clocks[index].check(tick, asked, answer.arrived)
        self.restarted[index] |= freshness is Freshness.RESTARTED
        return freshness is Freshness.FRESH

    def _state(self, time: float) -> HandState:
        positions, velocities, currents, voltages, temperatures = self._values.copy()
        return HandState(
            time=time,
            joint_names=self._names,
            positions=positions,
            velocities=velocities,
            currents=currents,
            voltages=voltages,
            temperatures=temperatures,
            ages=time - self._answered,
        )


def _in_si(joint: Joint, counts: dict[str, int]) -> tuple[float, float, float, float, float]:
    """Position, velocity, current, voltage, temperature of a joint."""
    return (
        joint.angle(counts["present_position"]),
        to_si("present_velocity", joint.sign * counts["present_velocity"]),
        to_si("present_current", joint.sign * counts["present_current"]),
        to_si("present_input_voltage", counts["present_input_voltage"]),
        float(counts["present_temperature"]),
    )


_TURN = 32.768  # [s], after which the tick begins anew
_SLACK = 0.002  # [s], rounding of ticks
_DRIFT = 0.03  # of the time since; with an oscillator farther off, no byte would get through
_LONGEST_LAG = 1.0  # [s], no answer lies on the way for longer
_FORGET = 10.0  # [s], after which the drift says nothing any more


class Freshness(Enum):
    """What the servo's clock says about an answer."""

    FRESH = "fresh"
    STALE = "made before it was asked for"
    RESTARTED = "made after a restart"


class ServoClock:
    """Tells whether a servo made its answer after it was asked, by its own clock.

    When a USB hub stalls, the answers to one cycle's question may arrive in the next cycle, and look
    like its answers. From then on each position would be a cycle too old, unnoticed. But every servo
    counts milliseconds (Realtime Tick, 0..32767, then from 0 again). An answer cannot arrive before it
    was made, so

        t_ours - t_servo <= t_arrival - tick

    and the least right side so far, grown by how much the clocks may have drifted apart since, bounds
    the offset between them from above. With it, the tick of an answer tells the latest time at which it
    can have been made. Where that is before the question, the answer is an old one.

    The same comparison shows a servo that has restarted by itself, as after a dip of its supply; it then
    holds no torque and has lost its gains and its current cap.
    """

    def __init__(self) -> None:
        self._offset: float | None = None  # [s], ours minus the servo's, at most
        self._since = 0.0  # [s], when that was so

    def forget(self) -> None:
        """Start anew, as after a reboot we asked for."""
        self._offset = None

    def check(self, tick: int, asked: float, arrived: float) -> Freshness:
        """Judge an answer, and learn from it unless it is an old one.

        Args:
            tick: The servo's Realtime Tick in its answer [ms].
            asked: Our time when the question went out [s].
            arrived: Our time when the answer came [s].
        """
        offset = arrived - tick / 1000
        if self._offset is None or arrived - self._since > _FORGET:
            self._offset, self._since = offset, arrived
            return Freshness.FRESH
        most = self._offset + _DRIFT * (arrived - self._since)
        on_the_way = (offset - most + _TURN / 2) % _TURN - _TURN / 2  # [s], at least
        if abs(on_the_way) > _LONGEST_LAG:
            return Freshness.RESTARTED
        if arrived - on_the_way < asked - _SLACK:
            return Freshness.STALE
        self._offset, self._since = most + min(on_the_way, 0.0), arrived
        return Freshness.FRESH
