# SPDX-License-Identifier: MIT
"""What the live loop asks of a hand and of its pads, whoever makes them.

Joints and pads go by name here: a driver may keep them in any order. ``hardware.servo`` is the driver for Dynamixel
servos, ``hardware.tactile`` that for this project's pad board; one contract test is run on every driver.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Self

import numpy as np

from vtgtsam.exceptions import VtgtsamError


class CommandError(VtgtsamError):
    """A commanded position breaks a rule; nothing was sent, torque stays as it was."""


@dataclass(frozen=True, eq=False)
class HandState:
    """The joints at one instant; arrays in the order of ``joint_names``, shape (J,).

    A joint that did not answer keeps its last values, and its age says so; one that has never answered is NaN
    with age infinity. What a driver does not measure is NaN.

    Attributes:
        time: Instant of the angles, monotonic clock [s].
        joint_names: Names of the joints.
        positions: Angles [rad].
        velocities: [rad/s].
        currents: What the motors draw, positive where they push towards larger angles [A].
        voltages: Supply at each motor [V].
        temperatures: [degrees Celsius].
        ages: How old each joint's values are at ``time`` [s]; 0 where it answered just now.
    """

    time: float
    joint_names: tuple[str, ...]
    positions: np.ndarray
    velocities: np.ndarray
    currents: np.ndarray
    voltages: np.ndarray
    temperatures: np.ndarray
    ages: np.ndarray

    @property
    def angles(self) -> dict[str, float]:
        """Angles [rad] by joint name."""
        return dict(zip(self.joint_names, self.positions.tolist(), strict=True))


class HandDevice(ABC):
    """A hand that moves; a context manager that takes the torque off on the way out."""

    @property
    @abstractmethod
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in an order of the driver's own."""

    @property
    @abstractmethod
    def limits(self) -> dict[str, tuple[float, float]]:
        """Least and largest angle that each joint may be sent to [rad], by name."""

    @property
    @abstractmethod
    def enabled(self) -> bool:
        """Whether torque is on and commands are taken."""

    @abstractmethod
    def configure(self) -> None:
        """Torque off, and everything set up that ``enable`` needs."""

    @abstractmethod
    def enable(self) -> None:
        """Torque on, with every joint told to stay where it is. Called again, it does the same."""

    @abstractmethod
    def state(self) -> HandState:
        """The joints now. Must be called every few cycles: it is here that trouble shows.

        Raises:
            VtgtsamError: The hand is in trouble, and the message says which and what to do; torque is off, unless
                the message says that this is not certain.
        """

    @abstractmethod
    def command(self, angles: Mapping[str, float]) -> None:
        """Send some joints to angles [rad], by name; the others keep their goals.

        Raises:
            CommandError: One of them breaks a rule; nothing was sent.
        """

    @abstractmethod
    def off(self) -> None:
        """Torque off, and seen to be.

        Raises:
            VtgtsamError: It is not certain.
        """

    @abstractmethod
    def close(self) -> None:
        """Torque off unless it is known to be off, and let go of the line."""

    def remarks(self) -> list[str]:
        """What people should hear of the connection and the motors so far; a line each."""
        return []

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, error: BaseException | None, trace: object) -> None:
        try:
            self.close()
        except VtgtsamError as second:
            if error is None:
                raise
            if isinstance(error, type(second)):  # says already what the torque is
                return
            # What went wrong first is the cause; the torque is what a person must hear of as well.
            raise type(second)(f"{error}; {second}") from error


@dataclass(frozen=True, eq=False)
class PadState:
    """All pads at one instant, in the order of the hand's pads.

    Attributes:
        pressure: Fraction of a press with 6 N, shape (K,); NaN where a pad is disabled or its input
            open or shorted.
        contacts: Contact bits, shape (K,); off where the pressure is NaN.
    """

    pressure: np.ndarray
    contacts: np.ndarray


class PadDevice(ABC):
    """Pads that tell what touches them; a context manager."""

    @abstractmethod
    def prepare(self) -> str:
        """Get ready while nothing touches the pads; what was found, for people, or an empty string.

        Raises:
            VtgtsamError: Pads are touched or broken; they are named.
        """

    @abstractmethod
    def since(self, instant: float) -> list[tuple[float, PadState]]:
        """The states measured after an instant of the monotonic clock, each with its own [s].

        Raises:
            VtgtsamError: The pads are gone.
        """

    def remarks(self) -> list[str]:
        """What people should hear of connection and pads so far; a line each."""
        return []

    @abstractmethod
    def close(self) -> None:
        """Let go of the device."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()
