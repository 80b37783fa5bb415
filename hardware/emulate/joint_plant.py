# SPDX-License-Identifier: MIT
"""A simulated hand in the place of the emulated servos' motors, in joints, radians and amperes."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Protocol

from hardware.servo.codec import to_si
from hardware.servo.description import Joint

from .motor import Drive, Motion


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
