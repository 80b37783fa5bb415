# SPDX-License-Identifier: MIT
"""The pads' signed distances to the object in one frame, which its tactile and its penetration factor share."""

from __future__ import annotations

from math import isfinite
from typing import NamedTuple

import gtsam
import numpy as np

from ..exceptions import FactorError
from ..sdf.search import ClosestPoints, PadContacts


class JointZeros(NamedTuple):
    """The joints' zeros as one more unknown of the pads' factors.

    The joints are at q - dq. A pad's distance is phi_k + G_k dq, to first order about the pads as measured; G is that
    of the pose at which the frame is begun, so that the factors' Jacobians are exact derivatives.

    Attributes:
        key: Key of dq, a vector of dimension J.
        jacobian: G = d phi / d dq [m/rad], shape (K, J).
    """

    key: int
    jacobian: np.ndarray


class PadDistances:
    """One frame's pads. It never changes: a factor that holds it is the same factor in every later frame.

    GTSAM evaluates several factors at each pose, and the error before the Jacobian: the last pose's answer is kept.

    Args:
        closest: Finds the pads' closest points to the object; frames may share it.
        T_hp: Pad poses in the hand, shape (K, 4, 4).
        touching: Which pads report contact, bool, shape (K,). The others matter where they reach into the object.

    Attributes:
        touching: As given.
    """

    def __init__(self, closest: ClosestPoints, T_hp: np.ndarray, touching: np.ndarray) -> None:
        self.touching = np.array(touching, dtype=bool)
        self._T_hp = np.array(T_hp, dtype=np.float64, order="C")
        self._closest = closest
        self._T_ho: gtsam.Pose3 | None = None
        self._contacts: PadContacts

    def at(self, T_ho: gtsam.Pose3) -> PadContacts:
        """The pads' closest points with the object at T_ho; a pad that does not matter is left out.

        Raises:
            FactorError: The pose is not finite.
        """
        if self._T_ho is None or not T_ho.equals(self._T_ho, 0.0):
            T = np.ascontiguousarray(T_ho.matrix())  # GTSAM's are in Fortran order
            flat = T.ravel()
            if not isfinite(flat.dot(flat)):
                raise FactorError(f"no distances at a pose that is not finite:\n{T}")
            self._contacts = self._closest.search(T, self._T_hp, self.touching)
            self._T_ho = T_ho
        return self._contacts

    def everywhere(self, T_ho: gtsam.Pose3) -> PadContacts:
        """The pads' closest points with the object at T_ho, no pad left out."""
        every = np.ones_like(self.touching)
        return self._closest.search(np.ascontiguousarray(T_ho.matrix()), self._T_hp, every)

    def points_h(self, contacts: PadContacts) -> np.ndarray:
        """The closest points in the hand's frame [m], shape (K, 3); NaN for a pad that was left out."""
        return self._closest.points(self._T_hp, contacts.indices)
