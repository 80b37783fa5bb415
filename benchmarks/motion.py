# SPDX-License-Identifier: MIT
"""Random poses and smooth motions from a seed."""

from __future__ import annotations

import numpy as np
from scipy.linalg import expm


def exp_se3(xi: np.ndarray) -> np.ndarray:
    """Pose (4, 4) of a twist (6,), rotation [rad] first, then translation [m]."""
    A = np.zeros((4, 4))
    A[:3, :3] = [[0, -xi[2], xi[1]], [xi[2], 0, -xi[0]], [-xi[1], xi[0], 0]]
    A[:3, 3] = xi[3:]
    return np.asarray(expm(A))


def random_pose(rng: np.random.Generator, rotation: float, translation: float) -> np.ndarray:
    """Pose (4, 4), normal in each component with these standard deviations [rad] and [m]."""
    return exp_se3(np.concatenate([rng.normal(0, rotation, 3), rng.normal(0, translation, 3)]))


def wander(rng: np.random.Generator, count: int, rotation: float, translation: float) -> np.ndarray:
    """Poses (F, 4, 4) that wander smoothly and come back, with these amplitudes [rad] and [m].

    Each component is a sine of its own phase and a period of 70 to 140 frames.
    """
    rate, phase = rng.uniform(0.045, 0.09, 6), rng.uniform(0, 2 * np.pi, 6)
    xi = np.sin(rate * np.arange(count)[:, None] + phase)
    return np.stack([exp_se3(x) for x in xi * np.repeat([rotation, translation], 3)])


def turn(count: int, step: float) -> np.ndarray:
    """Poses (F, 4, 4) that turn about x by ``step`` [rad] a frame."""
    return np.stack([exp_se3(np.array([n * step, 0, 0, 0, 0, 0])) for n in range(count)])
