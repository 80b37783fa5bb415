# SPDX-License-Identifier: MIT
"""What moves when emulated servos drive: free motors here, a simulated hand elsewhere.

Everything is in the servos' own units: ticks (4096 a turn), ticks/s, mA.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

from hardware.servo.description import Joint
from hardware.servo.table import to_si


@dataclass(frozen=True)
class Drive:
    """What a servo tells its motor.

    Attributes:
        torque: Whether the motor is driven at all.
        goal: Where to go [ticks].
        current_cap: Largest current [mA].
        p_gain: Position P gain, in the control table's unit.
        d_gain: Position D gain, in the control table's unit.
        speed: Largest speed [ticks/s].
    """

    torque: bool
    goal: float
    current_cap: float
    p_gain: float
    d_gain: float
    speed: float


@dataclass(frozen=True)
class Motion:
    """What the servo measures of its motor."""

    position: float  # [ticks]
    velocity: float = 0.0  # [ticks/s]
    current: float = 0.0  # [mA]


class Plant(Protocol):
    """Whatever the servos move, all of it at once."""

    def advance(self, dt: float, drives: Mapping[int, Drive]) -> Mapping[int, Motion]:
        """Let ``dt`` [s] pass under these drives and give each servo's motion, by servo id."""
        ...


@dataclass
class FreeMotors:
    """Motors with nothing attached, except obstacles one can put in their way.

    A motor goes to its goal with a time constant of 40 ms and stays there. Against an obstacle the
    current rises with the remaining error, as P gain and cap allow.

    Attributes:
        obstacles: Position [ticks] that a motor cannot pass upwards, by servo id.
    """

    obstacles: dict[int, float] = field(default_factory=dict)
    _positions: dict[int, float] = field(default_factory=dict)

    def place(self, servo_id: int, position: float) -> None:
        """Turn a motor by hand."""
        self._positions[servo_id] = position

    def advance(self, dt: float, drives: Mapping[int, Drive]) -> dict[int, Motion]:
        """Let ``dt`` [s] pass."""
        return {i: self._advance(i, dt, drive) for i, drive in drives.items()}

    def _advance(self, servo_id: int, dt: float, drive: Drive) -> Motion:
        position = self._positions.setdefault(servo_id, 2048.0)
        if not drive.torque:
            return Motion(position)
        error = drive.goal - position
        step = error * min(dt / _TIME_CONSTANT, 1.0)
        step = min(max(step, -drive.speed * dt), drive.speed * dt)
        wall = self.obstacles.get(servo_id, math.inf)
        blocked = step > 0 and position + step > wall >= position
        if blocked:
            step = wall - position
        wanted = error * drive.p_gain / _P_PER_MA if blocked else step / dt / _SPEED_PER_MA
        current = min(max(wanted, -drive.current_cap), drive.current_cap)
        self._positions[servo_id] = position + step
        return Motion(position + step, step / dt, current)


_TIME_CONSTANT = 0.04  # [s]
_P_PER_MA = 128.0  # [gain * ticks / mA], the e-manual's divisor of the P gain
_SPEED_PER_MA = 70.0  # [ticks/s / mA], 103 rpm without load draw some 100 mA


@dataclass(frozen=True)
class JointDrive:
    """What a joint's servo tells its motor.

    Attributes:
        torque: Whether the motor is driven at all.
        goal: Where to go [rad].
        current_cap: Largest current [A].
        speed: Largest speed [rad/s].
    """

    torque: bool
    goal: float
    current_cap: float
    speed: float


@dataclass(frozen=True)
class JointMotion:
    """What a joint does.

    Attributes:
        position: [rad].
        velocity: [rad/s].
        current: Positive towards larger angles [A].
    """

    position: float
    velocity: float = 0.0
    current: float = 0.0


class SimulatedJoints(Protocol):
    """A hand that moves in simulation."""

    def advance(self, dt: float, drives: Mapping[str, JointDrive]) -> Mapping[str, JointMotion]:
        """Let ``dt`` [s] pass under these drives; motions by joint name."""
        ...


class JointPlant:
    """The plant of a ``ServoLineEmulator`` whose servos drive simulated joints.

    Args:
        joints: Which servo drives which joint.
        simulated: The joints; ``advance`` is called in the emulator's thread, every 5 ms or so and
            before each answer, with the time that has really passed.
    """

    def __init__(self, joints: Sequence[Joint], simulated: SimulatedJoints) -> None:
        self._joints = tuple(joints)
        self._simulated = simulated

    def advance(self, dt: float, drives: Mapping[int, Drive]) -> dict[int, Motion]:
        """Let ``dt`` [s] pass."""
        told = {joint.name: _to_joint(joint, drives[joint.id]) for joint in self._joints}
        motions = self._simulated.advance(dt, told)
        return {joint.id: _to_servo(joint, motions[joint.name]) for joint in self._joints}


def _to_joint(joint: Joint, drive: Drive) -> JointDrive:
    return JointDrive(
        torque=drive.torque,
        goal=joint.angle(drive.goal),
        current_cap=drive.current_cap / 1000,
        speed=to_si("goal_position", drive.speed),
    )


def _to_servo(joint: Joint, motion: JointMotion) -> Motion:
    tick = to_si("goal_position", 1)
    return Motion(
        position=joint.zero + joint.sign * motion.position / tick,
        velocity=joint.sign * motion.velocity / tick,
        current=1000 * joint.sign * motion.current,
    )
