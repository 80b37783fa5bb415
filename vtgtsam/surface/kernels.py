# SPDX-License-Identifier: MIT
r"""The compiled searches, in one file since Numba's disk cache follows one file's changes only.

Of single points: depth first, the nearest box first, with a triangle that is probably close to begin
with; what is left to do is mostly to prove that nothing is closer.

Of grid nodes: blocks of 4 x 4 x 4 share one search for the triangles that can be nearest to any of
them. Let c be the block's centre, e half its side, and q the surface point nearest to c, at distance
D = |c - q| in the direction s = (c - q) / D. For a node x = c + d

    distance(x) <= |x - q| = sqrt(D^2 + 2 D s.d + |d|^2) <= D + s.d + |d|^2 / (2 D).

A triangle, or a box around several, whose nearest point to c lies at distance D' in the direction s'
is convex, and so is the distance to it, which therefore lies above its tangent at c:

    distance'(x) >= D' + s'.d.

So it may be left out where D' - D exceeds the largest (s - s').d + |d|^2 / (2 D) in the block, that
is e |s - s'|_1 + 3 e^2 / (2 D). What remains is a few dozen triangles, also far from the surface,
where the triangle inequality alone (D' - D > 2 sqrt(3) e) would keep hundreds.

``gaps`` (8,) is scratch that the caller makes in Python: where the compiler can see that its length
is 8, it unrolls the loops over it and then finds nothing to vectorise.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiled import compiled
from .tree import WIDTH

STACK = 256  # seven boxes wait at each level at most, and no mesh has 36 levels
BLOCK = 4  # nodes along a side of a block
GROUPS = 64  # times WIDTH: triangles kept for a block; where there are more, each node is searched


@compiled
def distances(tree: Any, points: Any, start: Any, in_order: bool, gaps: Any) -> Any:
    """Distances (N,) of points (N, 3), which try the slots ``start`` (N,) first and update them.

    With ``in_order`` each point but the first tries the slot found for the one before.
    """
    found = np.empty(len(points))
    stack, bounds = np.empty(STACK, np.int64), np.empty(STACK)
    for n in range(len(points)):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        slot = start[n - 1] if in_order and n > 0 else start[n]
        squared, start[n] = _nearest(tree, x, y, z, slot, stack, bounds, gaps)
        found[n] = np.sqrt(squared)
    return found


@compiled
def fill_blocks(tree: Any, ticks: Any, start: int, out: Any, rows: Any, gaps: Any) -> None:
    """Distances at one layer of blocks, at the nodes x = ``ticks[start + i]``, y and z = ``ticks``.

    Writes ``out`` (up to BLOCK, n, n); ``rows`` (GROUPS, 24, 8) is scratch.
    """
    stack, bounds = np.empty(STACK, np.int64), np.empty(STACK)
    nodes, half = len(ticks), (BLOCK - 1) / 2 * (ticks[1] - ticks[0])
    blocks, slot = (nodes + BLOCK - 1) // BLOCK, 0
    for block in range(blocks * blocks):
        j, k = block // blocks * BLOCK, block % blocks * BLOCK
        # At the upper ends the block reaches over the grid.
        x, y, z = ticks[start] + half, ticks[j] + half, ticks[k] + half
        count, slot = _candidates(tree, x, y, z, half, slot, stack, rows, gaps)
        groups = (count + WIDTH - 1) // WIDTH
        for node in range(len(out) * BLOCK * BLOCK):
            i, jj, kk = node // BLOCK**2, j + node // BLOCK % BLOCK, k + node % BLOCK
            if jj >= nodes or kk >= nodes:
                continue
            x, y, z = ticks[start + i], ticks[jj], ticks[kk]
            if groups <= GROUPS:
                squared = _least(rows, groups, x, y, z, gaps)
            else:
                squared, slot = _nearest(tree, x, y, z, slot, stack, bounds, gaps)
            out[i, jj, kk] = np.sqrt(squared)


@compiled
def _least(rows: Any, groups: int, x: float, y: float, z: float, gaps: Any) -> float:
    """Squared distance to the nearest of the triangles in ``rows[:groups]``."""
    best = np.inf
    for group in range(groups):
        _triangle_gaps(rows[group], x, y, z, gaps)
        for place in range(WIDTH):
            best = min(best, gaps[place])
    return best


@compiled
def _nearest(
    tree: Any, x: float, y: float, z: float, slot: int, stack: Any, bounds: Any, gaps: Any
) -> Any:
    """Squared distance of one point to the nearest triangle, and that triangle's slot.

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
    _triangle_gaps(tree.triangles[slot // WIDTH], x, y, z, gaps)
    best = gaps[slot % WIDTH]
    stack[0], bounds[0], waiting = 0, 0.0, 1
    while waiting > 0:
        waiting -= 1
        if not bounds[waiting] < best:
            continue
        node = stack[waiting]
        if node >= len(tree.boxes):
            leaf = node - len(tree.boxes)
            _triangle_gaps(tree.triangles[leaf], x, y, z, gaps)
            for place in range(WIDTH):
                if gaps[place] < best:
                    best, slot = gaps[place], leaf * WIDTH + place
            continue
        _box_gaps(tree.boxes[node], x, y, z, gaps)
        first = _first_child(tree, node)
        closest, least = -1, best
        for place in range(WIDTH):  # all that may hold something closer wait, the closest on top
            gap = gaps[place]
            if not gap < best:
                continue
            kept, bound = place, gap
            if gap < least:
                kept, bound, closest, least = closest, least, place, gap
            if kept >= 0:
                stack[waiting], bounds[waiting] = first + kept, bound
                waiting += 1
        if closest >= 0:
            stack[waiting], bounds[waiting] = first + closest, least
            waiting += 1
    return best, slot


@compiled
def _candidates(
    tree: Any,
    x: float,
    y: float,
    z: float,
    half: float,
    slot: int,
    stack: Any,
    rows: Any,
    gaps: Any,
) -> Any:
    """Copy the triangles that can be nearest in the block around (x, y, z), filling groups of eight.

    Returns their number, which may be more than ``rows`` holds, and the slot of the centre's nearest.
    """
    squared, slot = _nearest(tree, x, y, z, slot, stack, np.empty(STACK), gaps)
    least = np.sqrt(squared)
    to_nearest = _offset(tree.triangles[slot // WIDTH], slot % WIDTH, x, y, z)
    stack[0], waiting, count = 0, 1, 0
    while waiting > 0:
        waiting -= 1
        node = stack[waiting]
        if node < len(tree.boxes):
            first = _first_child(tree, node)
            for place in range(WIDTH if node > 0 else tree.top):
                offset = _box_offset(tree.boxes[node], place, x, y, z)
                if _can_be_nearest(offset, to_nearest, least, half):
                    stack[waiting] = first + place
                    waiting += 1
            continue
        triangles = tree.triangles[node - len(tree.boxes)]
        for place in range(WIDTH):
            if _can_be_nearest(_offset(triangles, place, x, y, z), to_nearest, least, half):
                _copy_triangle(triangles, place, rows, count)
                count += 1
    for empty in range(count, -(-count // WIDTH) * WIDTH):
        _copy_triangle(rows[0], 0, rows, empty)
    return count, slot


@compiled
def _can_be_nearest(offset: Any, to_nearest: Any, least: float, half: float) -> bool:
    """The bound above: ``offset`` is D' s', ``to_nearest`` is D s, ``least`` is D, ``half`` is e."""
    distance = np.sqrt(offset[0] ** 2 + offset[1] ** 2 + offset[2] ** 2)
    more = distance - least - 1e-9 * least  # rounding must not leave out the nearest itself
    if more > 2 * np.sqrt(3.0) * half:
        return False
    if distance == 0.0 or least == 0.0:
        return True
    turn = 0.0
    for axis in range(3):
        turn += abs(offset[axis] / distance - to_nearest[axis] / least)
    return bool(more <= half * turn + 1.5 * half * half / least)


@compiled
def _copy_triangle(triangles: Any, place: int, rows: Any, slot: int) -> None:
    """Write one triangle of a leaf to a slot of ``rows``, where it has that many."""
    if slot < len(rows) * WIDTH:
        for row in range(24):
            rows[slot // WIDTH, row, slot % WIDTH] = triangles[row, place]


@compiled
def _first_child(tree: Any, node: int) -> int:
    return WIDTH * (node - 1) + tree.top + 1 if node > 0 else 1


@compiled
def _box_gaps(boxes: Any, x: float, y: float, z: float, gaps: Any) -> None:
    """Squared distances of a point to eight boxes (6, 8)."""
    for n in range(len(gaps)):
        dx = max(max(boxes[0, n] - x, x - boxes[3, n]), 0.0)
        dy = max(max(boxes[1, n] - y, y - boxes[4, n]), 0.0)
        dz = max(max(boxes[2, n] - z, z - boxes[5, n]), 0.0)
        gaps[n] = dx * dx + dy * dy + dz * dz


@compiled
def _box_offset(boxes: Any, place: int, x: float, y: float, z: float) -> Any:
    """Vector to a point from the nearest point of one box of eight (6, 8)."""
    dx = min(x - boxes[0, place], 0.0) + max(x - boxes[3, place], 0.0)
    dy = min(y - boxes[1, place], 0.0) + max(y - boxes[4, place], 0.0)
    dz = min(z - boxes[2, place], 0.0) + max(z - boxes[5, place], 0.0)
    return dx, dy, dz


@compiled
def _triangle_gaps(rows: Any, x: float, y: float, z: float, gaps: Any) -> None:
    """Squared distances of a point to eight triangles, rows of ``Tree.triangles`` (24, 8).

    Over the triangle it is the distance to its plane, elsewhere the least of the three to its edges.
    """
    for n in range(len(gaps)):
        ax, ay, az = x - rows[0, n], y - rows[1, n], z - rows[2, n]
        bx, by, bz = x - rows[3, n], y - rows[4, n], z - rows[5, n]
        cx, cy, cz = x - rows[6, n], y - rows[7, n], z - rows[8, n]
        over_ab = ax * rows[9, n] + ay * rows[10, n] + az * rows[11, n]
        over_bc = bx * rows[12, n] + by * rows[13, n] + bz * rows[14, n]
        over_ca = cx * rows[15, n] + cy * rows[16, n] + cz * rows[17, n]
        plane = ax * rows[18, n] + ay * rows[19, n] + az * rows[20, n]
        to_ab = _edge_gap(ax, ay, az, ax - bx, ay - by, az - bz, rows[21, n])
        to_bc = _edge_gap(bx, by, bz, bx - cx, by - cy, bz - cz, rows[22, n])
        to_ca = _edge_gap(cx, cy, cz, cx - ax, cy - ay, cz - az, rows[23, n])
        over, beside = min(min(over_ab, over_bc), over_ca), min(min(to_ab, to_bc), to_ca)
        gaps[n] = (
            plane * plane if over > 0.0 else beside
        )  # both computed: a branch is not vectorised


@compiled
def _edge_gap(
    x: float, y: float, z: float, ex: float, ey: float, ez: float, inverse: float
) -> float:
    """Squared distance of (x, y, z) to the edge from the origin to e; ``inverse`` is 1 / |e|^2."""
    t = min(max((x * ex + y * ey + z * ez) * inverse, 0.0), 1.0)
    dx, dy, dz = x - t * ex, y - t * ey, z - t * ez
    return dx * dx + dy * dy + dz * dz


@compiled
def _offset(rows: Any, place: int, x: float, y: float, z: float) -> Any:
    """Vector to a point from the nearest point of one triangle of rows (24, 8)."""
    over = True
    best, offset = np.inf, (0.0, 0.0, 0.0)
    for corner in range(3):
        a, b, inward = 3 * corner, 3 * ((corner + 1) % 3), 9 + 3 * corner
        px, py, pz = x - rows[a, place], y - rows[a + 1, place], z - rows[a + 2, place]
        ex = rows[b, place] - rows[a, place]
        ey = rows[b + 1, place] - rows[a + 1, place]
        ez = rows[b + 2, place] - rows[a + 2, place]
        nx, ny, nz = rows[inward, place], rows[inward + 1, place], rows[inward + 2, place]
        over &= px * nx + py * ny + pz * nz > 0.0
        t = min(max((px * ex + py * ey + pz * ez) * rows[21 + corner, place], 0.0), 1.0)
        dx, dy, dz = px - t * ex, py - t * ey, pz - t * ez
        if dx * dx + dy * dy + dz * dz < best:
            best, offset = dx * dx + dy * dy + dz * dz, (dx, dy, dz)
    if over:
        nx, ny, nz = rows[18, place], rows[19, place], rows[20, place]
        plane = (x - rows[0, place]) * nx + (y - rows[1, place]) * ny + (z - rows[2, place]) * nz
        offset = (plane * nx, plane * ny, plane * nz)
    return offset
