# SPDX-License-Identifier: MIT
"""The point of each pad that is closest to the object."""

from __future__ import annotations

from typing import NamedTuple

import gtsam
import numpy as np

from ..hands.pads import PadSet
from .grid import GridSdf
from .pad_pose import points_in_world
from .search import ALWAYS, closest_on_pads, new_search


class PadContacts(NamedTuple):
    """Each pad's closest point at one object pose.

    Attributes:
        distances: Signed distances phi of the closest points [m], shape (K,).
        jacobians: Their derivatives for a right perturbation of T_wo, rotation first, shape (K, 6).
        indices: Which of ``PadSet.points_p`` the closest points are, shape (K,).

    A pad that was left out, since it does not touch and does not reach into the object, has an infinite distance,
    no derivative, and the index -1.
    """

    distances: np.ndarray
    jacobians: np.ndarray
    indices: np.ndarray

    @classmethod
    def room(cls, count: int) -> PadContacts:
        """Room for ``count`` pads' closest points."""
        return cls(np.zeros(count), np.zeros((count, 6)), np.zeros(count, dtype=np.int64))


class ClosestPoints:
    """Finds each pad's closest point at any object pose, the sooner the nearer it is to the poses before.

    Args:
        pads: The pads.
        sdf: The object's distance field.

    Attributes:
        T_wp: Pad poses in the world, shape (K, 4, 4).
        asked: Which pads' distances matter: ``ALWAYS`` of one in contact, ``IF_INSIDE`` of the others, shape (K,).
        search: What the search reads and remembers.
    """

    def __init__(self, pads: PadSet, sdf: GridSdf) -> None:
        count = len(pads)
        self.pads = pads
        self.T_wp = np.tile(np.eye(4), (count, 1, 1))
        self.asked = np.full(count, ALWAYS, dtype=np.int8)
        self.search = new_search(pads, sdf)

    def place(self, T_wp: np.ndarray, touching: np.ndarray | None = None) -> None:
        """Move the pads for the frame that begins.

        Args:
            T_wp: Pad poses in the world, shape (K, 4, 4).
            touching: Which pads report contact, bool, shape (K,). The others matter only where they reach into the
                object, and are left out elsewhere. None: all do, and no pad is left out.
        """
        self.T_wp[...] = T_wp
        self.asked[...] = ALWAYS if touching is None else touching  # the bits are the answers

    def at(self, T_wo: gtsam.Pose3) -> PadContacts:
        """The pads' closest points with the object at T_wo."""
        return self._search(T_wo, self.asked)

    def everywhere(self, T_wo: gtsam.Pose3) -> PadContacts:
        """The pads' closest points with the object at T_wo, no pad left out."""
        return self._search(T_wo, np.full_like(self.asked, ALWAYS))

    def points_w(self, contacts: PadContacts) -> np.ndarray:
        """The closest points in the world frame [m], shape (K, 3); NaN for a pad that was left out."""
        return points_in_world(self.T_wp, self.pads.points_p, contacts.indices)  # type: ignore[no-any-return]

    def _search(self, T_wo: gtsam.Pose3, asked: np.ndarray) -> PadContacts:
        contacts = PadContacts.room(len(asked))
        matrix = np.ascontiguousarray(T_wo.matrix())  # compiled code wants its own order
        closest_on_pads(matrix, self.T_wp, asked, *contacts, self.search.table)
        return contacts
