# SPDX-License-Identifier: MIT
"""The point of each pad that is closest to the object, shared by all factors of a frame."""

from __future__ import annotations

from dataclasses import dataclass

import gtsam
import numpy as np

from ..pads import PadSet
from .grid import GridSdf
from .kernels import closest_on_pads


@dataclass(frozen=True, eq=False)
class PadContacts:
    """Each pad's closest point at one object pose.

    Attributes:
        distances: Signed distances phi of the closest points [m], shape (K,).
        jacobians: Their derivatives for a right perturbation of T_wo, rotation first, shape (K, 6).
        indices: Which of ``PadSet.points_p`` the closest points are, shape (K,).
    """

    distances: np.ndarray
    jacobians: np.ndarray
    indices: np.ndarray


class ClosestPoints:
    """Finds each pad's closest point, once per object pose however many factors ask for it."""

    def __init__(self, pads: PadSet, sdf: GridSdf) -> None:
        self._pads = pads
        self._sdf = sdf
        self._T_wp = np.tile(np.eye(4), (len(pads), 1, 1))
        self._T_wo = np.full((4, 4), np.nan)
        self.at(gtsam.Pose3())  # compiles here, not in the control loop

    def place(self, T_wp: np.ndarray) -> None:
        """Move the pads to T_wp, shape (K, 4, 4), for the frame that begins."""
        self._T_wp = np.ascontiguousarray(T_wp, dtype=np.float64)
        self._T_wo = np.full((4, 4), np.nan)

    def at(self, T_wo: gtsam.Pose3) -> PadContacts:
        """The pads' closest points with the object at T_wo."""
        matrix = T_wo.matrix()
        if not np.array_equal(matrix, self._T_wo):
            self._contacts = PadContacts(
                *closest_on_pads(
                    self._sdf.values,
                    self._sdf.lower,
                    self._sdf.scale,
                    np.ascontiguousarray(matrix),
                    self._T_wp,
                    self._pads.points_p,
                    self._pads.offsets,
                )
            )
            self._T_wo = matrix
        return self._contacts

    def points_w(self, contacts: PadContacts) -> np.ndarray:
        """The closest points in the world frame [m], shape (K, 3)."""
        points_p = self._pads.points_p[contacts.indices]
        return np.einsum("kij,kj->ki", self._T_wp[:, :3, :3], points_p) + self._T_wp[:, :3, 3]
