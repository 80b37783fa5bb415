# SPDX-License-Identifier: MIT
"""The surface of a triangle mesh, to be asked for distances many times."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

import numpy as np

from .fill import BLOCK, fill_blocks
from .moved import PACKET, alike, cells, sum_distances
from .points import distances
from .tree import WIDTH, build_tree
from .triangles import empty_packet

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class Surface:
    """The surface of a triangle mesh, to be asked for distances many times.

    Attributes:
        tree: What the compiled searches work on.
    """

    def __init__(self, vertices: ArrayLike, faces: ArrayLike) -> None:
        corners = np.asarray(vertices, dtype=np.float64)[np.asarray(faces)]
        if corners.ndim != 3 or corners.shape[1:] != (3, 3) or len(corners) == 0:
            raise ValueError(f"a surface needs triangles, got corners of shape {corners.shape}")
        if not np.isfinite(corners).all():
            raise ValueError("the vertices of a surface must be finite")
        self.tree = build_tree(corners)

    def distances(self, points: ArrayLike, start: np.ndarray | None = None) -> np.ndarray:
        """Distance of each point (N, 3) to the nearest triangle [m], shape (N,); NaN stays NaN.

        Args:
            points: In the frame of the vertices [m].
            start: Slots of triangles to try first, int64 (N,), replaced by those found: any slot (0
                to begin with) gives the same distance, a near one sooner. None tries the triangle
                of the point before, which is near where the points lie in some order.
        """
        points = np.ascontiguousarray(points, dtype=np.float64)
        if points.ndim != 2 or points.shape[1] != 3:
            raise ValueError(f"points must have shape (N, 3), got {points.shape}")
        in_order = start is None
        if start is None:
            start = np.zeros(len(points), dtype=np.int64)
        gaps = np.empty(WIDTH)
        return distances(self.tree, points, start, in_order, gaps)

    def mean_distances(self, points: np.ndarray, transforms: np.ndarray) -> np.ndarray:
        """Mean distance of moved points to their nearest triangles [m], for each transform, shape (N,).

        Args:
            points: Finite points (P, 3) [m], P > 0.
            transforms: Rows (R | t) of the transforms that move them, shape (N, 3, 4); where one is not
                finite, the mean is NaN.
        """
        means = np.full(len(transforms), np.nan)
        finite = np.flatnonzero(np.isfinite(transforms).all(axis=(1, 2)))
        if len(finite) == 0:
            return means
        packet, gaps = empty_packet(PACKET), np.empty(WIDTH)
        for group in alike(transforms[finite], points):
            some = finite[group]
            rows = np.ascontiguousarray(transforms[some].reshape(-1, 12).T)
            grid = cells(transforms[some], points)
            sums = sum_distances(self.tree, points, rows, *grid, packet, gaps)
            means[some] = sums / len(points)
        return means

    def grid_distances(self, ticks: np.ndarray) -> np.ndarray:
        """Distances at the nodes of a cubic grid [m], shape (n, n, n).

        Works in as many threads as there are processors for this process.

        Args:
            ticks: Positions of the nodes along x, y and z alike [m], shape (n,), evenly spaced.
        """
        out = np.empty((len(ticks),) * 3)

        def fill(start: int) -> None:
            packet, gaps = empty_packet(BLOCK**3), np.empty(WIDTH)
            fill_blocks(self.tree, ticks, start, out[start : start + BLOCK], packet, gaps)

        with ThreadPoolExecutor(_processors()) as pool:
            list(pool.map(fill, range(0, len(ticks), BLOCK)))
        return out


def _processors() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
