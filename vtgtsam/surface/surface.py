# SPDX-License-Identifier: MIT
"""The surface of a triangle mesh, to be asked for distances many times."""

from __future__ import annotations

import os
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

import numpy as np

from .kernels import BLOCK, GROUPS, distances, fill_blocks
from .tree import WIDTH, build_tree

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
        return distances(self.tree, points, start, in_order, gaps)  # type: ignore[no-any-return]

    def grid_distances(self, ticks: np.ndarray) -> np.ndarray:
        """Distances at the nodes of a cubic grid [m], shape (n, n, n).

        Works in as many threads as there are processors for this process.

        Args:
            ticks: Positions of the nodes along x, y and z alike [m], shape (n,), evenly spaced.
        """
        out = np.empty((len(ticks),) * 3)

        def fill(start: int) -> None:
            rows = np.empty((GROUPS, 24, WIDTH))
            fill_blocks(self.tree, ticks, start, out[start : start + BLOCK], rows, np.empty(WIDTH))

        with ThreadPoolExecutor(_processors()) as pool:
            list(pool.map(fill, range(0, len(ticks), BLOCK)))
        return out


def _processors() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
