# SPDX-License-Identifier: MIT
"""Pads' points as tiles: compact groups of neighbours, which the search looks at together.

Hands repeat few shapes of pads. Pads with the same points share one set of tiles: what the search reads each frame is
several times smaller, and likelier to be in the processor's cache.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from ..hands.pads import PadSet

TILE = 8  # points: as many as one vector of single-precision numbers
FIRST_TILE, TILES, FIRST_POINT, FIRST_FLOOR, FIRST_INDEX = range(5)  # columns of ``Tiles.pads``


class Tiles(NamedTuple):
    """All pads' points, each shape of pad once.

    Attributes:
        pads: For each pad the number of its shape's first tile, how many tiles it has, its shape's first point, the
            number of its own first tile where each pad counts its own, and its first point in ``PadSet.points_p``;
            shape (K, 5).
        points: Points in the pad frame [m], shape (S, 3).
        order: Which of its pad's points a tile holds, shape (T * TILE,); a pad's last tile repeats points to be full.
        coordinates: Those points in single precision, shape (3, T * TILE).
        boxes: Centre and half extents of each tile, widened by a margin, in single precision, shape (6, T).
        pad_boxes: Centre and half extents of each pad's points, shape (K, 2, 3).
    """

    pads: np.ndarray
    points: np.ndarray
    order: np.ndarray
    coordinates: np.ndarray
    boxes: np.ndarray
    pad_boxes: np.ndarray


def cut_into_tiles(pads: PadSet, margin: float) -> Tiles:
    """The pads' points as tiles, whose boxes are ``margin`` [m] wider than their points on each side."""
    shapes: dict[bytes, tuple[int, int, int]] = {}
    table, points, order = [], [], []
    tiles = seen = own = 0
    for pad, index in zip(pads.pads, pads.offsets[:-1], strict=True):
        key = pad.points_p.tobytes()
        if key not in shapes:
            groups = _groups(pad.points_p, np.arange(len(pad.points_p)))
            shapes[key] = tiles, len(groups), seen
            points.append(pad.points_p)
            order += [np.resize(group, TILE) for group in groups]
            tiles, seen = tiles + len(groups), seen + len(pad.points_p)
        first, count, first_point = shapes[key]
        table.append((first, count, first_point, own, index))
        own += count
    all_points = np.concatenate(points)
    starts = np.concatenate([np.full(n * TILE, start) for _, n, start in shapes.values()])
    all_order = np.concatenate(order)
    coordinates = np.ascontiguousarray(all_points[starts + all_order].T, dtype=np.float32)
    return Tiles(
        pads=np.array(table, dtype=np.int64),
        points=all_points,
        order=all_order,
        coordinates=coordinates,
        boxes=_boxes(coordinates, margin),
        pad_boxes=_pad_boxes(pads),
    )


def _groups(points: np.ndarray, indices: np.ndarray) -> list[np.ndarray]:
    """Halve points (M, 3) along their longer side until each group has at most ``TILE``."""
    if len(points) <= TILE:
        return [indices]
    along = np.argsort(points[:, np.ptp(points, axis=0).argmax()], kind="stable")
    middle = math.ceil(len(points) / TILE / 2) * TILE
    halves = along[:middle], along[middle:]
    return [group for half in halves for group in _groups(points[half], indices[half])]


def _boxes(coordinates: np.ndarray, margin: float) -> np.ndarray:
    points = coordinates.reshape(3, -1, TILE)
    least, most = points.min(axis=2), points.max(axis=2)
    boxes = np.concatenate([(least + most) / 2, (most - least) / 2 + np.float32(margin)])
    return np.ascontiguousarray(boxes, dtype=np.float32)


def _pad_boxes(pads: PadSet) -> np.ndarray:
    bounds = np.array([(pad.points_p.min(axis=0), pad.points_p.max(axis=0)) for pad in pads.pads])
    return np.stack([bounds.mean(axis=1), np.ptp(bounds, axis=1) / 2], axis=1)
