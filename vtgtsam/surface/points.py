# SPDX-License-Identifier: MIT
"""The nearest triangle to single points.

Depth first, the nearest box first, with a triangle that is probably close to begin with; what is left to do is
mostly to prove that nothing is closer.

``gaps`` (8,) is scratch that the caller makes in Python: where the compiler can see that its length is 8, it
unrolls the loops over it and then finds nothing to vectorise.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from .boxes import STACK, box_gaps, children_wait
from .tree import WIDTH, Tree
from .triangles import triangle_gaps


@compiled
def distances(
    tree: Tree,
    points: NDArray[np.float64],
    start: NDArray[np.int64],
    in_order: bool,
    gaps: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Distances (N,) of points (N, 3), which try the slots ``start`` (N,) first and update them.

    With ``in_order`` each point but the first tries the slot found for the one before. NaN where a point is not
    finite.
    """
    found = np.empty(len(points))
    stack, bounds = np.empty(STACK, np.int64), np.empty(STACK)
    for n in range(len(points)):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        slot = start[n - 1] if in_order and n > 0 else start[n]
        squared = np.nan
        if np.isfinite(x) and np.isfinite(y) and np.isfinite(z):
            squared, slot = _nearest(tree, x, y, z, slot, stack, bounds, gaps)
        start[n] = slot
        found[n] = np.sqrt(squared)
    return found


@compiled
def _nearest(
    tree: Tree,
    x: float,
    y: float,
    z: float,
    slot: int,
    stack: NDArray[np.int64],
    bounds: NDArray[np.float64],
    gaps: NDArray[np.float64],
) -> tuple[float, int]:
    """Squared distance of one finite point to the nearest triangle, and that triangle's slot.

    Args:
        tree: A ``Tree``.
        x: The point, with ``y`` and ``z`` [m].
        y: See ``x``.
        z: See ``x``.
        slot: The triangle to try first: its leaf times 8 plus its place there.
        stack: Scratch for nodes that wait, int64 (STACK,).
        bounds: Scratch for their squared distances (STACK,).
        gaps: Scratch (8,).
    """
    triangle_gaps(tree.triangles[slot // WIDTH], x, y, z, gaps)
    best = gaps[slot % WIDTH]
    stack[0], bounds[0], waiting = 0, 0.0, 1
    while waiting > 0:
        waiting -= 1
        if not bounds[waiting] < best:
            continue
        node = stack[waiting]
        if node < len(tree.boxes):
            box_gaps(tree.boxes[node], x, y, z, gaps)
            waiting = children_wait(tree, node, gaps, best, stack, bounds, waiting)
            continue
        leaf = node - len(tree.boxes)
        triangle_gaps(tree.triangles[leaf], x, y, z, gaps)
        least, closest = np.inf, 0
        for place in range(WIDTH):
            closest = place if gaps[place] < least else closest
            least = min(least, gaps[place])
        if least < best:
            best, slot = least, leaf * WIDTH + closest
    return best, slot
