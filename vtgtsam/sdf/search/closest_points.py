# SPDX-License-Identifier: MIT
"""The point of each pad that is closest to the object."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...hands.pads import PadSet
from ..grid import GridSdf
from .compiled_search import Memory, Room, closest_on_pads
from .field import read_field
from .pad_pose import ROUNDING, place_points
from .tiles import cut_into_tiles


class PadContacts(NamedTuple):
    """Each pad's closest point at one object pose.

    Attributes:
        distances: Signed distances phi of the closest points [m], shape (K,).
        jacobians: Their derivatives dphi/dxi for a right perturbation of T_wo, rotation first, shape (K, 6).
        indices: Which of ``PadSet.points_p`` the closest points are, shape (K,).

    A pad that was left out has an infinite distance, a derivative of zeros, and the index -1.
    """

    distances: NDArray[np.float64]
    jacobians: NDArray[np.float64]
    indices: NDArray[np.int64]


class ClosestPoints:
    """Finds the point of each pad that is closest to the object, at one pose after another.

    It remembers the poses before to be fast where they follow each other; what it answers does not depend on them. A
    copy remembers nothing.

    Args:
        pads: The pads.
        sdf: The object's distance field.

    Attributes:
        pads: The pads.
        sdf: The object's distance field.
    """

    def __init__(self, pads: PadSet, sdf: GridSdf) -> None:
        self.pads = pads
        self.sdf = sdf
        tiles = cut_into_tiles(pads, ROUNDING * float((sdf.upper - sdf.lower).max()))
        field = read_field(sdf, tiles.radius)
        self._known = (*field, *tiles, *Memory.empty(tiles), *Room.enough_for(tiles))
        self._points_p = np.array(pads.points_p)
        self._shape = len(pads), 4, 4

    def search(
        self, T_wo: NDArray[np.float64], T_wp: NDArray[np.float64], needed: NDArray[np.bool_]
    ) -> PadContacts:
        """Each pad's closest point: distances [m], their derivatives and indices, in new arrays.

        The world may be any frame that both poses are given in. A pose that is not finite leaves its pads out.

        Args:
            T_wo: Object pose in the world, shape (4, 4), float64.
            T_wp: Pad poses in the world, shape (K, 4, 4), float64.
            needed: Which pads' distances are needed, shape (K,), bool. Of the others only negative ones matter: a pad
                that does not reach into the object is left out.
        """
        count = len(needed)
        T_wo = _accepted("T_wo", T_wo, (4, 4), _FLOAT)
        T_wp = _accepted("T_wp", T_wp, self._shape, _FLOAT)
        needed = _accepted("needed", needed, self._shape[:1], _BOOL)
        distances, jacobians = np.empty(count), np.empty((count, 6))
        indices = np.empty(count, np.int64)
        closest_on_pads(T_wo, T_wp, needed, distances, jacobians, indices, *self._known)
        return PadContacts(distances, jacobians, indices)

    def points(self, T_wp: NDArray[np.float64], indices: NDArray[np.int64]) -> NDArray[np.float64]:
        """The pads' points of these indices in the world [m], shape (K, 3); NaN where the index is -1.

        Args:
            T_wp: Pad poses in the world, shape (K, 4, 4), float64.
            indices: For each pad which of ``PadSet.points_p``, as in ``PadContacts``, shape (K,), int64.
        """
        T_wp = _accepted("T_wp", T_wp, self._shape, _FLOAT)
        indices = _accepted("indices", indices, self._shape[:1], _INT)
        points_w = np.empty((len(indices), 3))
        place_points(T_wp, self._points_p, indices, points_w)
        return points_w

    def __reduce__(self) -> tuple[Any, ...]:
        return ClosestPoints, (self.pads, self.sdf)


_FLOAT, _BOOL, _INT = np.dtype(np.float64), np.dtype(np.bool_), np.dtype(np.int64)


def _accepted(
    name: str, array: NDArray[Any], shape: tuple[int, ...], dtype: np.dtype[Any]
) -> NDArray[Any]:
    """The array, or a copy that can be written to: compiled code is compiled for one kind alone."""
    if array.shape == shape and array.dtype == dtype and array.flags.carray:
        return array
    if array.shape == shape and array.dtype == dtype and array.flags.c_contiguous:
        return array.copy()
    order = "" if array.flags.c_contiguous else ", not C-contiguous"
    raise ValueError(
        f"{name} must be a C-contiguous {dtype} array of shape {shape}, got {array.dtype} of shape {array.shape}{order}"
    )
