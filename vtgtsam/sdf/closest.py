# SPDX-License-Identifier: MIT
"""The point of each pad that is closest to the object, shared by all factors of a frame."""

from __future__ import annotations

import math
from typing import NamedTuple

import gtsam
import numpy as np

from ..pads import PadSet
from .grid import GridSdf
from .search import ROUNDING, TILE, closest_on_pads, points_in_world


class PadContacts(NamedTuple):
    """Each pad's closest point at one object pose.

    Attributes:
        distances: Signed distances phi of the closest points [m], shape (K,).
        jacobians: Their derivatives for a right perturbation of T_wo, rotation first, shape (K, 6).
        indices: Which of ``PadSet.points_p`` the closest points are, shape (K,).
        touching: Which pads report contact, shape (K,).

    A pad that was left out, since it does not touch and does not reach into the object, has an infinite distance,
    no derivative, and the index -1.
    """

    distances: np.ndarray
    jacobians: np.ndarray
    indices: np.ndarray
    touching: np.ndarray


class ClosestPoints:
    """Finds each pad's closest point, once per object pose however many factors ask for it.

    Args:
        pads: The pads.
        sdf: The object's distance field.
    """

    def __init__(self, pads: PadSet, sdf: GridSdf) -> None:
        count = len(pads)
        self._pads = pads
        order, tiles, offsets = _cut_into_tiles(pads)
        tile_boxes = _tile_boxes(tiles, ROUNDING * float((sdf.upper - sdf.lower).max()))
        reach = int(np.ceil(np.linalg.norm(tile_boxes[3:], axis=0).max() * sdf.scale.max())) + 1
        self._grid = (
            sdf.values,
            sdf.bends(reach),
            sdf.lower,
            sdf.scale,
            _lipschitz(sdf),
            sdf.largest,
        )
        self._points = (pads.points_p, _pad_boxes(pads), order, tiles, tile_boxes, offsets)
        # What the search remembers from pose to pose: see search.py.
        self._memory = (
            np.empty(TILE, np.float32),
            np.full(offsets[-1], -np.inf),
            np.zeros(count),
            pads.offsets[:-1].copy(),
            np.full((count, 3, 4), np.inf),
            np.zeros(count, dtype=bool),
        )
        self._all = np.ones(count, dtype=bool)
        self._T_wo = gtsam.Pose3()
        self.place(np.tile(np.eye(4), (count, 1, 1)))

    def place(self, T_wp: np.ndarray, touching: np.ndarray | None = None) -> None:
        """Move the pads for the frame that begins.

        Args:
            T_wp: Pad poses in the world, shape (K, 4, 4).
            touching: Which pads report contact, bool, shape (K,). The others matter only where they reach into the
                object, and are left out elsewhere. None: all do, and no pad is left out.
        """
        self._T_wp = np.array(T_wp, dtype=np.float64, order="C")  # compiled code wants its own
        self._touching = self._all if touching is None else np.array(touching, dtype=bool)
        self._contacts: PadContacts | None = None

    def at(self, T_wo: gtsam.Pose3) -> PadContacts:
        """The pads' closest points with the object at T_wo; the same object again for the same pose."""
        if self._contacts is None or not T_wo.equals(self._T_wo, 0.0):
            self._T_wo, self._contacts = T_wo, self._search(T_wo, self._touching)
        return self._contacts

    def everywhere(self, T_wo: gtsam.Pose3) -> PadContacts:
        """The pads' closest points with the object at T_wo, no pad left out."""
        return self._search(T_wo, self._all)

    def points_w(self, contacts: PadContacts) -> np.ndarray:
        """The closest points in the world frame [m], shape (K, 3); NaN for a pad that was left out."""
        return points_in_world(self._T_wp, self._pads.points_p, contacts.indices)  # type: ignore[no-any-return]

    def _search(self, T_wo: gtsam.Pose3, wanted: np.ndarray) -> PadContacts:
        distances, jacobians, indices = closest_on_pads(
            T_wo.matrix(), self._T_wp, wanted, *self._grid, *self._points, *self._memory
        )
        return PadContacts(distances, jacobians, indices, self._touching)


def _lipschitz(sdf: GridSdf) -> np.ndarray:
    """Lipschitz constants inside the grid and anywhere, shape (2,)."""
    return np.array([sdf.lipschitz, np.hypot(sdf.lipschitz, 1.0)])


def _pad_boxes(pads: PadSet) -> np.ndarray:
    """Centre and half extents of each pad's points along its axes, (K, 2, 3)."""
    bounds = np.array([(pad.points_p.min(axis=0), pad.points_p.max(axis=0)) for pad in pads.pads])
    return np.stack([bounds.mean(axis=1), np.ptp(bounds, axis=1) / 2], axis=1)


def _tile_boxes(tiles: np.ndarray, margin: float) -> np.ndarray:
    """Centre and half extents of each tile, widened by ``margin`` [m], (6, N) in single precision."""
    points = tiles.reshape(3, -1, TILE)
    least, most = points.min(axis=2), points.max(axis=2)
    return np.concatenate([(least + most) / 2, (most - least) / 2 + np.float32(margin)])


def _cut_into_tiles(pads: PadSet) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The pads' points as compact groups of ``TILE``.

    Returns:
        order: Indices into the points, (N * TILE,); a pad's last group repeats points to be full.
        tiles: The points in single precision, (3, N * TILE).
        offsets: Pad k's tiles are offsets[k] to offsets[k + 1], (K + 1,).
    """
    groups = [
        _groups(pad.points_p, np.arange(begin, begin + len(pad.points_p)))
        for pad, begin in zip(pads.pads, pads.offsets, strict=False)
    ]
    order = np.concatenate([np.resize(group, TILE) for pad in groups for group in pad])
    tiles = pads.points_p[order].T
    offsets = np.cumsum([0, *(len(pad) for pad in groups)])
    return order, np.ascontiguousarray(tiles, dtype=np.float32), offsets


def _groups(points: np.ndarray, indices: np.ndarray) -> list[np.ndarray]:
    """Halve points (M, 3) along their longer side until each group has at most ``TILE``."""
    if len(points) <= TILE:
        return [indices]
    along = np.argsort(points[:, np.ptp(points, axis=0).argmax()], kind="stable")
    middle = math.ceil(len(points) / TILE / 2) * TILE
    halves = along[:middle], along[middle:]
    return [group for half in halves for group in _groups(points[half], indices[half])]
