# SPDX-License-Identifier: MIT
"""A tree of bounding boxes around triangles, eight children to a box and eight triangles to a leaf.

Eight lie side by side in memory, so that one instruction works on several of them.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

WIDTH = 8  # children to a box, triangles to a leaf


class Tree(NamedTuple):
    """Boxes and triangles, eight side by side.

    The root is node 0; its children are nodes 1 to ``top``, and eight follow for each of these, and
    so on. The last level's are the leaves.

    Attributes:
        boxes: Lower and upper corners of each inner node's children [m], shape (nodes, 6, 8).
        triangles: Rows of ``_describe`` for each leaf's triangles, shape (leaves, 19, 8).
        top: Number of the root's children.
    """

    boxes: NDArray[np.float64]
    triangles: NDArray[np.float64]
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
    """Rows that describe the triangles (F, 3, 3), eight to a leaf, shape (leaves, 19, 8).

    Each triangle ABC, with AB its longest edge, has a frame of its own: the origin at A, u along AB, v
    in the plane towards C, w across it. Its rows: w, then u, then v, each a direction and the origin's
    coordinate along it; the length of AB; direction (u, v) and length of BC; and of AC. Without area, v
    is any direction across AB, and an edge without length has any direction.
    """
    lengths = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    turn = (lengths.argmax(axis=1)[:, None] + np.arange(3)) % 3
    a, b, c = np.take_along_axis(corners, turn[:, :, None], axis=1).transpose(1, 0, 2)
    u, ab = _direction(b - a, np.array([1.0, 0.0, 0.0]))
    across = _across(c - a, u)
    lowest = np.eye(3)[np.abs(u).argmin(axis=1)]
    flat = np.linalg.norm(across, axis=1) <= 1e-14 * ab
    v, _ = _direction(_across(np.where(flat[:, None], lowest, across), u), u)
    w = np.cross(u, v)
    frame = [np.append(axis, _dot(axis, a)[:, None], axis=1) for axis in (w, u, v)]
    edges = []
    for start, end in ((b, c), (a, c)):
        edge = np.stack([_dot(end - start, u), _dot(end - start, v)], axis=1)
        direction, length = _direction(edge, np.array([1.0, 0.0]))
        edges += [direction, length[:, None]]
    rows = np.concatenate([*frame, ab[:, None], *edges], axis=1)
    return np.ascontiguousarray(rows.reshape(-1, WIDTH, rows.shape[1]).transpose(0, 2, 1))


def _direction(vectors: np.ndarray, where_zero: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Unit vectors (F, d) along vectors (F, d), and the lengths (F,) of these."""
    lengths = np.linalg.norm(vectors, axis=1)
    directions = np.broadcast_to(where_zero, vectors.shape).copy()
    some = lengths > 0
    directions[some] = vectors[some] / lengths[some, None]
    return directions, lengths


def _across(vectors: np.ndarray, u: np.ndarray) -> np.ndarray:
    """Parts of vectors (F, 3) across the directions u (F, 3); taken twice, since once leaves rounding."""
    for _ in range(2):
        vectors = vectors - _dot(vectors, u)[:, None] * u
    return vectors


def _dot(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    return np.asarray((a * b).sum(axis=1))
