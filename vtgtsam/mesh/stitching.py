# SPDX-License-Identifier: MIT
"""Meshes whose parts nearly meet, or whose faces are there twice: put together."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .reading import merged

if TYPE_CHECKING:
    import trimesh

NEAR = 5e-5  # of the longest extent: vertices so close are one
MOSTLY = 0.5  # of the faces: where so many are there twice, the mesh is double-sided


def stitched(mesh: trimesh.Trimesh) -> tuple[trimesh.Trimesh, list[str]]:
    """The mesh with vertices merged that nearly meet, and no face twice; and a sentence for each problem."""
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    place = _places(vertices, NEAR * float(mesh.extents.max()))
    faces = place[faces]
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    faces, problems = _without_doubles(faces)
    if len(faces) == 0:
        return mesh, problems  # flat, and refused as such
    return merged(vertices, faces), problems


def _places(vertices: np.ndarray, distance: float) -> np.ndarray:
    """For each vertex the first of those that chains of neighbours nearer than ``distance`` lead to."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import cKDTree

    pairs = cKDTree(vertices).query_pairs(distance, output_type="ndarray")
    if len(pairs) == 0:
        return np.arange(len(vertices))
    links = coo_array((np.ones(len(pairs)), pairs.T), shape=(len(vertices),) * 2)
    _, label = connected_components(links, directed=False)
    _, first = np.unique(label, return_index=True)
    return np.asarray(first[label])


def _without_doubles(faces: np.ndarray) -> tuple[np.ndarray, list[str]]:
    """One of the faces that are there several times; none of those that look both ways between two bodies."""
    corners = np.sort(faces, axis=1)
    _, first, which, count = np.unique(
        corners, axis=0, return_index=True, return_inverse=True, return_counts=True
    )
    which = which.ravel()
    several = count[which] > 1
    if not several.any():
        return faces, []
    # +1 or -1: whether the corners are an even or an odd exchange away from their sorted order
    turn = np.where(
        (np.argsort(faces, axis=1) == [[0, 1, 2]]).all(axis=1)
        | (np.argsort(faces, axis=1) == [[1, 2, 0]]).all(axis=1)
        | (np.argsort(faces, axis=1) == [[2, 0, 1]]).all(axis=1),
        1,
        -1,
    )
    both_ways = np.bincount(which, weights=turn) == 0
    double_sided = several.mean() > MOSTLY
    keep = np.zeros(len(faces), dtype=bool)
    keep[first] = True
    if double_sided:
        return faces[keep], [
            "the faces of the mesh are there twice (it is double-sided); one of each was taken, and which "
            "side is out was found anew"
        ]
    keep &= ~(several & both_ways[which])
    return faces[keep], []
