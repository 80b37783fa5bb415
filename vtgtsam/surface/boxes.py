# SPDX-License-Identifier: MIT
"""The boxes of a ``Tree``: how far they are, and which of them wait to be looked into."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled, inlined, inlined_fast
from .tree import WIDTH, Tree

STACK = 256  # seven boxes wait at each level at most, and no mesh has 36 levels


@inlined_fast
def box_gaps(
    boxes: NDArray[np.float64], x: float, y: float, z: float, gaps: NDArray[np.float64]
) -> None:
    """Squared distances of a finite point to eight boxes (6, 8)."""
    for n in range(len(gaps)):
        dx = max(max(boxes[0, n] - x, x - boxes[3, n]), 0.0)
        dy = max(max(boxes[1, n] - y, y - boxes[4, n]), 0.0)
        dz = max(max(boxes[2, n] - z, z - boxes[5, n]), 0.0)
        gaps[n] = dx * dx + dy * dy + dz * dz


@compiled
def box_offset(
    boxes: NDArray[np.float64], place: int, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """Vector to a point from the nearest point of one box of eight (6, 8)."""
    dx = min(x - boxes[0, place], 0.0) + max(x - boxes[3, place], 0.0)
    dy = min(y - boxes[1, place], 0.0) + max(y - boxes[4, place], 0.0)
    dz = min(z - boxes[2, place], 0.0) + max(z - boxes[5, place], 0.0)
    return dx, dy, dz


@inlined
def children_wait(
    tree: Tree,
    node: int,
    gaps: NDArray[np.float64],
    limit: float,
    stack: NDArray[np.int64],
    bounds: NDArray[np.float64],
    waiting: int,
) -> int:
    """Let a node's children wait whose squared distance is below a limit, the closest on top.

    Args:
        tree: A ``Tree``.
        node: The node, not a leaf.
        gaps: Squared distances of its children (8,).
        limit: What they must be below.
        stack: Nodes that wait, int64 (STACK,).
        bounds: Their squared distances (STACK,).
        waiting: How many wait; what is returned is the new number.
    """
    first = WIDTH * (node - 1) + tree.top + 1 if node > 0 else 1
    closest, least = waiting, np.inf
    for place in range(WIDTH):  # without branches, which would be guessed wrong half the time
        gap = gaps[place]
        stack[waiting], bounds[waiting] = first + place, gap
        closest = waiting if gap < least else closest
        least = min(least, gap)
        waiting += gap < limit
    if least < limit:
        last = waiting - 1
        stack[closest], stack[last] = stack[last], stack[closest]
        bounds[closest], bounds[last] = bounds[last], least
    return waiting
