# SPDX-License-Identifier: MIT
"""The grasp controller: joint angles in, commanded joint angles out (paper, "Grasp Motion Control").

Each closing joint follows an incremental position offset. Its command grows at a fixed rate, but runs
ahead of the measured angle by at most a fixed lead, so that the servo's torque stays below gain x lead:

    command = min(command + rate dt, q + lead, upper limit)

Inner joints close first; the thumb starts after the fingers have closed. Simulated and real hands are closed
by the same code. The paper gives the motion's form, the numbers are ours.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from .description import GraspDescription

RATE = 1.2  # [rad/s], growth of the commanded angle
LEAD = 0.3  # [rad], the command's largest lead over the measured angle; times gain it limits torque
STAGGER = 0.35  # [s], by which each joint starts after the next inner one
THUMB_DELAY = 2.0  # [s], the thumb starts: 1.6 rad / RATE + 2 STAGGER = 2.0
CLOSED = 4.5  # [s], after which the hand has closed: THUMB_DELAY + 2.0, and time to press


class GraspController:
    """Closes one hand once.

    Args:
        description: Which joints close, and in which order.
        joint_names: Order of the angles given and returned.
        limits: Lower and upper limit of each joint [rad], shape (J, 2).
        rate: Growth of the command [rad/s].
        lead: Largest lead of the command over the measured angle [rad].
    """

    def __init__(
        self,
        description: GraspDescription,
        joint_names: Sequence[str],
        limits: np.ndarray,
        rate: float = RATE,
        lead: float = LEAD,
    ) -> None:
        self._rate, self._lead = rate, lead
        self._sign = np.array([description.sign(name) for name in joint_names])
        self._starts = np.array([_start_time(description, name) for name in joint_names])
        self._closed = np.where(self._sign > 0, limits[:, 1], -limits[:, 0])
        self.command = np.array([description.start.get(name, 0.0) for name in joint_names])

    def step(self, time: float, dt: float, joints: np.ndarray) -> np.ndarray:
        """The angles to command now [rad], shape (J,).

        Args:
            time: Since the grasp began [s]; before 0 the hand stays open.
            dt: Since the last call [s].
            joints: Measured angles [rad], shape (J,).
        """
        command = self._sign * self.command  # as if every joint closed by a positive angle
        ahead = np.minimum(command + self._rate * dt, self._sign * joints + self._lead)
        closing = time >= self._starts
        self.command = self._sign * np.where(closing, np.minimum(ahead, self._closed), command)
        return self.command


def _start_time(description: GraspDescription, joint: str) -> float:
    rank = description.ranks().get(joint)
    if rank is None:
        return np.inf
    delay = THUMB_DELAY if joint in description.thumb else 0.0
    return delay + rank * STAGGER
