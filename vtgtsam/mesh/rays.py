# SPDX-License-Identifier: MIT
"""Straight rays through a mesh, wherever its faces look.

libigl takes a triangle of less than about 5e-7 square units for a ray's edge case and misses it, so
the mesh is enlarged first until its faces are some units large.
"""

from __future__ import annotations

import numpy as np

FACE = 1e3  # units, size of a mean face after enlarging: faces a million times smaller are hit, too


class Rays:
    """The faces of a mesh, to be hit by rays.

    Args:
        vertices: [m], shape (V, 3).
        faces: Shape (F, 3).
    """

    def __init__(self, vertices: np.ndarray, faces: np.ndarray) -> None:
        import igl

        corners = np.asarray(vertices, dtype=np.float64)[faces]
        doubled = np.linalg.norm(
            np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1
        )
        self._scale = FACE / max(np.sqrt(float(doubled.mean()) / 2), 1e-12)
        self._vertices = np.ascontiguousarray(vertices, dtype=np.float64) * self._scale
        self._faces = np.ascontiguousarray(faces, dtype=np.int64)
        self._tree = igl.AABB()
        self._tree.init(self._vertices, self._faces)

    def first(self, points: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Distance to the first face [m], shape (N,), inf where there is none.

        Args:
            points: Where the rays begin [m], shape (N, 3).
            directions: Unit vectors, shape (N, 3).
        """
        hit, length, _ = self._tree.intersect_ray_first(
            self._vertices, self._faces, points * self._scale, np.ascontiguousarray(directions)
        )
        return np.where(np.asarray(hit) >= 0, np.asarray(length) / self._scale, np.inf)

    def crossings(self, points: np.ndarray, directions: np.ndarray) -> list[np.ndarray]:
        """Distances to all faces that each ray crosses [m], in their order.

        Args:
            points: Where the rays begin [m], shape (N, 3).
            directions: Unit vectors, shape (N, 3).
        """
        hits = self._tree.intersect_ray(
            self._vertices, self._faces, points * self._scale, np.ascontiguousarray(directions)
        )
        return [np.sort([hit[1] for hit in of_ray]) / self._scale for of_ray in hits]

    def outside(self, points: np.ndarray, rng: np.random.Generator, rays: int = 3) -> np.ndarray:
        """Share of rays from each point that cross an even number of faces, shape (N,).

        Of a point outside a closed surface all do, of one inside none, whichever way its faces look.

        Args:
            points: [m], shape (N, 3).
            rng: Draws the rays' directions.
            rays: How many, for each point.
        """
        directions = rng.normal(size=(len(points) * rays, 3))
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        crossed = self.crossings(np.repeat(points, rays, axis=0), directions)
        even = np.array([len(lengths) % 2 == 0 for lengths in crossed], dtype=np.float64)
        return np.asarray(even.reshape(len(points), rays).mean(axis=1))
