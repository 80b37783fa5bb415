# SPDX-License-Identifier: MIT
"""Pads' points as tiles: compact groups of neighbours, which the search looks at together.

Hands repeat few shapes of pads. Pads with the same points share one set of tiles: what the search reads each frame is
several times smaller, and likelier to be in the processor's cache.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...hands.pads import PadSet

TILE = 8  # points: as many as one vector of single-precision numbers


class Tiles(NamedTuple):
    """All pads' points, each shape of pad once, T tiles in all.

    Attributes:
        first: Each pad's first tile, shape (K,).
        counts: How many tiles it has, shape (K,).
        offsets: Its first point in ``PadSet.points_p``, shape (K,).
        points: The tiles' points in the pad frame [m], shape (T * TILE, 3); a pad's last tile repeats points to be
            full.
        order: Which of its pad's points each of them is, shape (T * TILE,).
        coordinates: The points in single precision, shape (3, T * TILE).
        boxes: Centre and half extents of each tile [m], widened by a margin, in single precision, shape (6, T).
        pad_boxes: Centre and half extents of each pad's points [m], shape (K, 2, 3).
    """

    first: NDArray[np.int64]
    counts: NDArray[np.int64]
    offsets: NDArray[np.int64]
    points: NDArray[np.float64]
    order: NDArray[np.int64]
    coordinates: NDArray[np.float32]
    boxes: NDArray[np.float32]
    pad_boxes: NDArray[np.float64]

    @property
    def radius(self) -> float:
        """The largest half diagonal of a tile's box [m]."""
        return float(np.linalg.norm(self.boxes[3:], axis=0).max())


def cut_into_tiles(pads: PadSet, margin: float) -> Tiles:
    """The pads' points as tiles, whose boxes are ``margin`` [m] wider than their points on each side."""
    shapes: dict[bytes, tuple[int, int]] = {}  # by its points: first tile, how many
    points, order, total = [], [], 0
    for pad in pads.pads:
        key = pad.points_p.tobytes()
        if key not in shapes:
            groups = _groups(pad.points_p, np.arange(len(pad.points_p)))
            full = np.concatenate([np.resize(group, TILE) for group in groups])
            points.append(pad.points_p[full])
            order.append(full)
            shapes[key] = total, len(groups)
            total += len(groups)
    of_pads = np.array([shapes[pad.points_p.tobytes()] for pad in pads.pads], dtype=np.int64)
    all_points = np.concatenate(points)
    coordinates = np.ascontiguousarray(all_points.T, dtype=np.float32)
    return Tiles(
        first=of_pads[:, 0].copy(),
        counts=of_pads[:, 1].copy(),
        offsets=np.array(pads.offsets[:-1], dtype=np.int64),
        points=all_points,
        order=np.concatenate(order).astype(np.int64),
        coordinates=coordinates,
        boxes=_boxes(coordinates, margin),
        pad_boxes=_pad_boxes(pads),
    )


def _groups(points: NDArray[np.float64], indices: NDArray[np.intp]) -> list[NDArray[np.intp]]:
    """Points (M, 3), given as ``indices``, halved along their longer side until each group has at most ``TILE``."""
    if len(points) <= TILE:
        return [indices]
    along = np.argsort(points[:, np.ptp(points, axis=0).argmax()], kind="stable")
    middle = math.ceil(len(points) / TILE / 2) * TILE
    halves = along[:middle], along[middle:]
    return [group for half in halves for group in _groups(points[half], indices[half])]


def _boxes(coordinates: NDArray[np.float32], margin: float) -> NDArray[np.float32]:
    points = coordinates.reshape(3, -1, TILE)
    least, most = points.min(axis=2), points.max(axis=2)
    boxes = np.concatenate([(least + most) / 2, (most - least) / 2 + np.float32(margin)])
    return np.ascontiguousarray(boxes, dtype=np.float32)


def _pad_boxes(pads: PadSet) -> NDArray[np.float64]:
    bounds = np.array([(pad.points_p.min(axis=0), pad.points_p.max(axis=0)) for pad in pads.pads])
    return np.stack([bounds.mean(axis=1), np.ptp(bounds, axis=1) / 2], axis=1)
