# SPDX-License-Identifier: MIT
"""A tree of bounding boxes around triangles, eight children to a box and eight triangles to a leaf.

Eight lie side by side in memory, so that one instruction works on several of them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

WIDTH = 8  # children to a box, triangles to a leaf


class Tree(NamedTuple):
    """Boxes and triangles, eight side by side.

    The root is node 0; its children are nodes 1 to ``top``, and eight follow for each of these, and
    so on. The last level's are the leaves.

    Attributes:
        boxes: Lower and upper corners of each inner node's children [m], shape (nodes, 6, 8).
        triangles: Rows of ``_describe`` for each leaf's triangles, shape (leaves, 24, 8).
        top: Number of the root's children.
    """

    boxes: np.ndarray
    triangles: np.ndarray
    top: int


def build_tree(corners: np.ndarray) -> Tree:
    """The tree of triangles with these corners, shape (F, 3, 3)."""
    levels, top = _levels(len(corners))
    corners = corners[_sorted(corners.sum(axis=1), levels, top)]
    return Tree(_boxes(corners, levels), _describe(corners), top)


def _levels(count: int) -> tuple[int, int]:
    """Levels of eightfold nodes below the root's children, and the number of these, 1 to 8."""
    leaves, levels = -(-count // WIDTH), 0
    while leaves > WIDTH ** (levels + 1):
        levels += 1
    return levels, -(-leaves // WIDTH**levels)


def _sorted(centres: np.ndarray, levels: int, top: int) -> np.ndarray:
    """Order in which triangles with these centres (F, 3) fill the leaves.

    Groups are halved along their longest side until they are leaves. So that all halves are equal,
    some triangles are taken twice, spread evenly.
    """
    slots = top * WIDTH ** (levels + 1)
    groups = _cut(centres, (np.arange(slots) * len(centres) // slots)[None], top)
    for _ in range(3 * levels):  # 2^3 = WIDTH
        groups = _cut(centres, groups, 2)
    return groups.ravel()


def _cut(centres: np.ndarray, groups: np.ndarray, parts: int) -> np.ndarray:
    """Sort each row of ``groups`` along its longest side and cut it into equal parts."""
    places = centres[groups]
    longest = np.ptp(places, axis=1).argmax(axis=1)
    along = np.take_along_axis(places, longest[:, None, None], axis=2)[..., 0]
    groups = np.take_along_axis(groups, along.argsort(axis=1, kind="stable"), axis=1)
    return groups.reshape(len(groups) * parts, -1)


def _boxes(corners: np.ndarray, levels: int) -> np.ndarray:
    """Boxes of each inner node's children, shape (nodes, 6, 8), the root first."""
    lower = corners.reshape(-1, 3 * WIDTH, 3).min(axis=1)
    upper = corners.reshape(-1, 3 * WIDTH, 3).max(axis=1)
    rows = []
    for _ in range(levels):
        lower, upper = lower.reshape(-1, WIDTH, 3), upper.reshape(-1, WIDTH, 3)
        rows.append(np.concatenate([lower, upper], axis=2).transpose(0, 2, 1))
        lower, upper = lower.min(axis=1), upper.max(axis=1)
    root = np.full((1, 6, WIDTH), np.inf)  # infinitely far where there is no child
    root[0, :, : len(lower)] = np.concatenate([lower, upper], axis=1).T
    return np.ascontiguousarray(np.concatenate([root, *reversed(rows)]))


def _describe(corners: np.ndarray) -> np.ndarray:
    """Rows that describe the triangles (F, 3, 3), eight to a leaf, shape (leaves, 24, 8).

    Of each: three corners; three inward normals of the edges, in its plane; its normal; one over
    the squared length of each edge. A triangle without area has no normals and counts as its edges.
    """
    edges = np.roll(corners, -1, axis=1) - corners
    squared = (edges**2).sum(axis=-1)
    normals = np.cross(edges[:, 0], -edges[:, 2])
    area = np.linalg.norm(normals, axis=-1)
    flat = area <= 1e-10 * squared.max(axis=-1)
    normals /= np.where(flat, 1.0, area)[:, None]
    normals[flat] = 0.0
    inward = np.cross(normals[:, None, :], edges)
    inverse = np.divide(1.0, squared, out=np.zeros_like(squared), where=squared > 0)
    rows = np.concatenate([corners.reshape(-1, 9), inward.reshape(-1, 9), normals, inverse], axis=1)
    return np.ascontiguousarray(rows.reshape(-1, WIDTH, 24).transpose(0, 2, 1))
