# SPDX-License-Identifier: MIT
r"""How an object moves in a hand: free, moving or held, and how much its pose there may change in each mode.

What holds an object is contact, and what moves it in the hand is fingers that move:

- ``free``: no pad touches;
- ``held``: enough pads touch, and the fastest pad is slower than a limit;
- ``moving``: what is between.

Between two frames the pose in the hand performs a random walk whose covariance grows with time,
dt diag(sigma_rotation^2, sigma_translation^2) with a mode's sigmas per square root of a second.

Neighbouring frames err alike (the same joint zero, the same view), the longer the less the object moves. So a frame
counts as one of ``correlation`` / dt that say the same: all of its terms are divided by that number against the memory.
"""

from __future__ import annotations

from collections import deque
from typing import Literal

import numpy as np

from .config import EstimatorConfig, ModeSettings

Mode = Literal["free", "moving", "held"]

SPEED_OVER = 0.1  # [s], over which pads' speeds are taken: encoders are too coarse for less
SHORTEST = 0.01  # [s], frames closer in time say the same as if they were so far apart


class ModeFilter:
    """Tells the mode from contacts and from the motion of the pads in the hand.

    Args:
        config: The modes' limits.
    """

    def __init__(self, config: EstimatorConfig) -> None:
        self._config = config
        self._past: deque[tuple[float, np.ndarray]] = deque()

    def mode(self, time: float, touching: np.ndarray, T_hp: np.ndarray) -> Mode:
        """The mode at an instant [s], from contact bits (K,) and pad poses in the hand (K, 4, 4)."""
        if not np.isfinite(T_hp[0, 0, 0]):
            return "moving"  # it is not known what the hand does
        speed = self._speed(time, T_hp[:, :3, 3])
        count = np.count_nonzero(touching)
        if count == 0:
            return "free"
        held = count >= self._config.held_pads and speed < self._config.held_speed
        return "held" if held else "moving"

    def displace(self, by_h: np.ndarray) -> None:
        """Have the pads where another calibration has them, moved in the hand by so much [m], shape (K, 3)."""
        self._past = deque((time, positions + by_h) for time, positions in self._past)

    def _speed(self, time: float, positions_h: np.ndarray) -> float:
        """Speed of the fastest pad in the hand [m/s]; 0 in the first frame."""
        past = self._past
        while len(past) > 1 and past[1][0] <= time - SPEED_OVER:
            past.popleft()
        speed = 0.0
        if past and time > past[0][0]:
            way = np.linalg.norm(positions_h - past[0][1], axis=1).max()
            speed = float(way) / max(time - past[0][0], SHORTEST)
        past.append((time, positions_h.copy()))
        return speed


def random_walk(settings: ModeSettings, dt: float) -> np.ndarray:
    """Covariance of the change of the pose in the hand within dt [s], shape (6, 6), rotation first."""
    return np.diag(np.repeat(np.square([settings.rotation, settings.translation]), 3) * dt)


def repetitions(correlation: float, dt: float) -> float:
    """As one of how many a frame counts, at least 1, dt [s] after the one before, if all err alike for so long [s]."""
    return max(1.0, correlation / max(dt, SHORTEST))
