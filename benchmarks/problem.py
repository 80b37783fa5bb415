# SPDX-License-Identifier: MIT
"""A benchmark problem as plain arrays, which every solver reads from the same file.

NumPy alone is imported here: Theseus lives in an environment without GTSAM.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np


@dataclass(frozen=True, eq=False)
class Problem:
    """Frames of one object and one set of pads, and the settings all solvers share.

    Attributes:
        values: Signed distances at the grid's nodes [m], float32, shape (nx, ny, nz), object frame.
        lower: Position of the first node [m], shape (3,).
        upper: Position of the last node [m], shape (3,).
        points_p: All pads' grid points, each in its pad's frame [m], shape (P, 3).
        offsets: Pad k's points are ``points_p[offsets[k]:offsets[k + 1]]``, shape (K + 1,).
        T_wp: Pad poses in the world, shape (F, K, 4, 4).
        contacts: Contact bits, shape (F, K).
        T_visual: Visual poses of the object in the world, shape (F, 4, 4).
        T_true: Where the object is, shape (F, 4, 4).
        T_start: Where each frame starts when it is solved by itself, shape (F, 4, 4).
        w_vis: Visual weights, (rotation [1/rad^2], translation [1/m^2]).
        w_tac: Tactile weight [1/m^2].
        w_pen: Penetration weight [1/m^2].
        log_theta_vis: Log of the visual Welsch loss's theta.
        log_theta_tac: Log of the tactile Welsch loss's theta.
        damping: Levenberg-Marquardt damping.
        iterations: Iterations a frame.
    """

    values: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    points_p: np.ndarray
    offsets: np.ndarray
    T_wp: np.ndarray
    contacts: np.ndarray
    T_visual: np.ndarray
    T_true: np.ndarray
    T_start: np.ndarray
    w_vis: np.ndarray
    w_tac: float = 1.0
    w_pen: float = 1.0
    log_theta_vis: float = -6.5
    log_theta_tac: float = 0.0
    damping: float = 0.02
    iterations: int = 5

    @property
    def frames(self) -> int:
        """Number of frames."""
        return len(self.T_wp)

    @property
    def pads(self) -> int:
        """Number of pads."""
        return len(self.offsets) - 1

    def save(self, path: str | Path) -> None:
        """Write to an ``.npz`` file."""
        np.savez(path, **{field.name: getattr(self, field.name) for field in fields(self)})

    @classmethod
    def load(cls, path: str | Path) -> Problem:
        """Read what ``save`` wrote."""
        with np.load(path, allow_pickle=False) as arrays:
            read = {field.name: arrays[field.name] for field in fields(cls)}
        return cls(**{name: a.item() if a.ndim == 0 else a for name, a in read.items()})
