# SPDX-License-Identifier: MIT
"""The point of each pad that is closest to the object."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...hands.pads import PadSet
from ..grid import GridSdf
from ..pad_pose import points_in_world
from .tabled import closest_on_pads, new_search


class PadContacts(NamedTuple):
    """Each pad's closest point at one object pose.

    Attributes:
        distances: Signed distances phi of the closest points [m], shape (K,).
        jacobians: Their derivatives for a right perturbation of T_wo, rotation first, shape (K, 6).
        indices: Which of ``PadSet.points_p`` the closest points are, shape (K,).

    A pad that was left out has an infinite distance, no derivative, and the index -1.
    """

    distances: NDArray[np.float64]
    jacobians: NDArray[np.float64]
    indices: NDArray[np.int64]


class ClosestPoints:
    """Finds each pad's closest point at any object pose.

    It remembers the poses before only to be fast: the answer does not depend on them.

    Args:
        pads: The pads.
        sdf: The object's distance field.
    """

    def __init__(self, pads: PadSet, sdf: GridSdf) -> None:
        self.pads = pads
        self.sdf = sdf
        self._search = new_search(pads, sdf)

    def search(
        self, T_wo: NDArray[np.float64], T_wp: NDArray[np.float64], needed: NDArray[np.bool_]
    ) -> PadContacts:
        """The pads' closest points, in new arrays.

        Args:
            T_wo: Object pose in the world, or in any other frame that the pad poses are in too, shape (4, 4).
            T_wp: Pad poses in the same frame, shape (K, 4, 4).
            needed: Which pads' distances are needed, shape (K,). The others matter only where they reach into the
                object, and are left out elsewhere.
        """
        count = len(self.pads)
        _expect("T_wo", T_wo, (4, 4), np.float64)
        _expect("T_wp", T_wp, (count, 4, 4), np.float64)
        _expect("needed", needed, (count,), np.bool_)
        contacts = PadContacts(np.empty(count), np.empty((count, 6)), np.empty(count, np.int64))
        closest_on_pads(T_wo, T_wp, needed.view(np.int8), *contacts, self._search.table)
        return contacts

    def points(self, T_wp: NDArray[np.float64], indices: NDArray[np.int64]) -> NDArray[np.float64]:
        """Point ``indices[k]`` of each pad k in the world [m], shape (K, 3); NaN where the index is -1.

        Args:
            T_wp: Pad poses in the world, shape (K, 4, 4).
            indices: Which of ``PadSet.points_p``, shape (K,), as in ``PadContacts``.
        """
        count = len(self.pads)
        _expect("T_wp", T_wp, (count, 4, 4), np.float64)
        _expect("indices", indices, (count,), np.int64)
        total = len(self.pads.points_p)
        if not ((indices >= -1) & (indices < total)).all():
            raise ValueError(f"indices must be from -1 to {total - 1}, got {indices.tolist()}")
        return points_in_world(T_wp, self.pads.points_p, indices)  # type: ignore[no-any-return]


def _expect(name: str, array: np.ndarray, shape: tuple[int, ...], dtype: type[np.generic]) -> None:
    if array.shape != shape or array.dtype != dtype or not array.flags.c_contiguous:
        order = "" if array.flags.c_contiguous else ", not contiguous"
        raise ValueError(
            f"{name} must be a C-contiguous {np.dtype(dtype)} array of shape {shape}, "
            f"got {array.dtype} of shape {array.shape}{order}"
        )
