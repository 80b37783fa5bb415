# SPDX-License-Identifier: MIT
"""Whether a joint's count can be believed while its motor pulls.

An encoder that sticks reads like a finger that has met the object: the count stands, and the goal runs ahead of it.
Two things tell them apart, and only the first for certain.

The motor's current. A motor that stands draws what its position loop asks for, as it has no back-EMF:

    I = min(cap, P |goal - count| / 128)    [mA], counts in ticks

One that draws far less turns, or drives nothing. So a count that stays the same to the last tick, far behind its goal
and with little current, is wrong, and the hand must stop. A finger that is really blocked draws its cap.

How it came to stand. A finger that meets something gives way while the pull rises: pads, gears and links yield by some
ticks (0.1 N m on a finger of 40 mm that yields by 0.1 mm a newton: 4 ticks). A stuck encoder stops dead, from speed to
not one tick more. So may a finger on something very hard, and once both draw their caps nothing in servo or count tells
them apart: this is said, and stops nothing.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from .description import Joint
from .table import to_si

_TICK = to_si("goal_position", 1)  # [rad]
_P_UNIT = 128.0  # [gain * ticks / mA], the e-manual's divisor of the P gain
_BEHIND = 0.2  # [rad], a count so far behind its goal lets the motor pull
_LITTLE = 0.4  # of the current of a motor that stands; less is drawn by one that turns
_TURNING = 0.06  # [s], in which a motor told to move has moved by a tick or draws its current
_ANSWERS = 3  # of the servo at least in that time
_FAST = 0.3  # [rad/s], a joint that stands one cycle later has stopped dead
_STANDS = 0.5  # [s], for which it must then have stood to the last tick
_FULL = 0.8  # of the current of a motor that stands, drawn where something is in its way


@dataclass
class _Count:
    """What one joint's count has done."""

    count: int
    time: float  # [s], of the last answer
    changed: float  # [s], when it last changed
    speed: float = math.nan  # [rad/s], before it stood; NaN where it has never moved
    light_since: float = math.nan  # [s], since when the motor draws little
    light: int = 0  # answers in that time
    told: bool = False


class EncoderWatch:
    """Follows one joint's count, goal and current.

    Args:
        joint: The joint.

    Attributes:
        stuck: Why its count is wrong, for people; empty where nothing says so.
        doubtful: That it stopped as a stuck encoder does, or a finger on something very hard; empty where it did not.
    """

    def __init__(self, joint: Joint) -> None:
        self._joint = joint
        self._past: _Count | None = None
        self.stuck = ""
        self.doubtful = ""

    def forget(self) -> None:
        """Torque is off or was: what it did before says nothing any more."""
        self._past = None
        self.stuck = ""

    def see(self, time: float, count: int, goal: int, current: float) -> None:
        """Take over one answer of its servo under torque.

        Args:
            time: When it came [s].
            count: Present position [ticks].
            goal: Goal position [ticks].
            current: Present current [mA], positive towards larger counts.
        """
        past = self._past
        if past is None:
            self._past = _Count(count, time, changed=time)
            return
        drawn, behind = self._pull(goal - count, current)
        if count != past.count:
            speed = abs(count - past.count) * _TICK / max(time - past.time, 1e-3)
            self._past = _Count(count, time, changed=time, speed=speed)
            return
        past.time = time
        self._see_light(past, drawn < _LITTLE and behind > _BEHIND)
        self._see_dead_stop(past, drawn, behind)

    def _pull(self, error: int, current: float) -> tuple[float, float]:
        """What the motor draws, as a fraction of what it would standing, and how far it is behind [rad]."""
        standing = min(1000 * self._joint.current, self._joint.gains.P * abs(error) / _P_UNIT)
        drawn = math.copysign(current, current * error) / standing if standing else 1.0
        return drawn, abs(error) * _TICK

    def _see_light(self, past: _Count, light: bool) -> None:
        if not light:
            past.light, past.light_since = 0, math.nan
            return
        if past.light == 0:
            past.light_since = past.time
        past.light += 1
        if past.light >= _ANSWERS and past.time - past.light_since >= _TURNING:
            self.stuck = (
                f"{self._joint.label} reads {self._joint.angle(past.count):.2f} rad to the last tick, although it is "
                "told to move and its motor draws too little to be blocked: its encoder is stuck, or its motor drives "
                "nothing; do not use the hand before that servo is changed"
            )

    def _see_dead_stop(self, past: _Count, drawn: float, behind: float) -> None:
        stands = past.time - past.changed >= _STANDS
        blocked = drawn >= _FULL and behind > _BEHIND
        if past.told or not (stands and blocked and past.speed >= _FAST):
            return
        past.told = True
        self.doubtful = (
            f"{self._joint.label} stopped dead at {self._joint.angle(past.count):.2f} rad and has not moved by a tick "
            "since, under full current: it met something very hard, or its encoder is stuck; look at it"
        )
