# SPDX-License-Identifier: MIT
"""Distances in single precision, several points at a time, wrong by a known rounding.

A pad's pose comes as the map A p from the pad's frame to cells of the grid, ``A`` (3, 4) float32. The loops over
points inside the grid have no branch, so that the compiler works on eight points at once.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiled import inlined, inlined_fast
from .bends import SHIFT


@inlined
def look(
    flat: Any, shape: Any, cell: Any, A: Any, tiles: Any, begin: int, inside: bool, near: Any
) -> float:
    """Distances of the points from ``begin`` into ``near`` (TILE,); returns the least.

    Args:
        flat: Distances at the grid's nodes.
        shape: Numbers of nodes.
        cell: Sides of a cell [m], (3,) float32.
        A: The map from the pad's frame to cells.
        tiles: Points in the pad's frame, (3, N * TILE).
        begin: A tile's first point.
        inside: Whether the pad is inside the grid.
        near: Room for the distances.
    """
    if inside:
        look_inside(flat, shape, A, tiles, begin, near)
    else:
        look_anywhere(flat, shape, cell, A, tiles, begin, near)
    return least(near)  # type: ignore[no-any-return]


@inlined_fast
def least(values: Any) -> float:
    """Least of some values, none of them NaN."""
    found = values[0]
    for n in range(1, len(values)):
        found = values[n] if values[n] < found else found
    return found  # type: ignore[no-any-return]


@inlined_fast
def look_inside(flat: Any, shape: Any, A: Any, tiles: Any, begin: int, near: Any) -> None:
    """Distances of points that are all inside the grid."""
    sx, sy = np.uint32(shape[1] * shape[2]), np.uint32(shape[2])
    a00, a01, a02, b0 = A[0, 0], A[0, 1], A[0, 2], A[0, 3]
    a10, a11, a12, b1 = A[1, 0], A[1, 1], A[1, 2], A[1, 3]
    a20, a21, a22, b2 = A[2, 0], A[2, 1], A[2, 2], A[2, 3]
    for n in range(len(near)):
        x, y, z = tiles[0, begin + n], tiles[1, begin + n], tiles[2, begin + n]
        u = a00 * x + a01 * y + a02 * z + b0
        v = a10 * x + a11 * y + a12 * z + b1
        w = a20 * x + a21 * y + a22 * z + b2
        i, j, k = np.int32(u), np.int32(v), np.int32(w)
        at = np.uint32(i) * sx + np.uint32(j) * sy + np.uint32(k)
        fx, fy, fz = u - np.float32(i), v - np.float32(j), w - np.float32(k)
        near[n] = in_cell(flat, at, sx, sy, fx, fy, fz)[0]


@inlined_fast
def look_anywhere(
    flat: Any, shape: Any, cell: Any, A: Any, tiles: Any, begin: int, near: Any
) -> None:
    """Distances of points inside or outside the grid."""
    nx, ny, nz = shape
    sx, sy = np.uint32(ny * nz), np.uint32(nz)
    zero, hx, hy, hz = np.float32(0), cell[0], cell[1], cell[2]
    a00, a01, a02, b0 = A[0, 0], A[0, 1], A[0, 2], A[0, 3]
    a10, a11, a12, b1 = A[1, 0], A[1, 1], A[1, 2], A[1, 3]
    a20, a21, a22, b2 = A[2, 0], A[2, 1], A[2, 2], A[2, 3]
    for n in range(len(near)):
        x, y, z = tiles[0, begin + n], tiles[1, begin + n], tiles[2, begin + n]
        u = a00 * x + a01 * y + a02 * z + b0
        v = a10 * x + a11 * y + a12 * z + b1
        w = a20 * x + a21 * y + a22 * z + b2
        cu = min(max(u, zero), np.float32(nx - 1))
        cv = min(max(v, zero), np.float32(ny - 1))
        cw = min(max(w, zero), np.float32(nz - 1))
        i = min(np.int32(cu), np.int32(nx - 2))
        j = min(np.int32(cv), np.int32(ny - 2))
        k = min(np.int32(cw), np.int32(nz - 2))
        at = np.uint32(i) * sx + np.uint32(j) * sy + np.uint32(k)
        fx, fy, fz = cu - np.float32(i), cv - np.float32(j), cw - np.float32(k)
        phi = in_cell(flat, at, sx, sy, fx, fy, fz)[0]
        dx, dy, dz = (u - cu) * hx, (v - cv) * hy, (w - cw) * hz
        near[n] = phi + np.sqrt(dx * dx + dy * dy + dz * dz)


@inlined_fast
def raise_floors(
    flat: Any, shape: Any, bends: Any, A: Any, boxes: Any, margin: float, floors: Any
) -> None:
    """Raise each tile's floor to what a look at its centre says, for tiles inside the grid.

    With c a tile's centre and e its half extents in the pad's frame, no point of it is nearer than

        phi(c) - sum_a e_a |dphi/dp_a| - sum_i d_i H_ii - 1/2 sum_ij d_i d_j H_ij,    d_i = sum_a |A_ia| e_a,

    with the bounds H of second differences (see ``bends``).

    Args:
        flat: Distances at the grid's nodes.
        shape: Numbers of nodes.
        bends: Bounds of second differences in blocks of cells.
        A: The map from the pad's frame to cells.
        boxes: Centres and half extents of the tiles, (6, N).
        margin: What makes a floor of a distance [m].
        floors: The tiles' floors, (N,).
    """
    sx, sy = np.uint32(shape[1] * shape[2]), np.uint32(shape[2])
    bounds, by, bz = bends.ravel(), np.uint32(bends.shape[1]), np.uint32(bends.shape[2])
    shift = np.uint32(SHIFT)
    one, half = np.float32(1), np.float32(0.5)
    a00, a01, a02, b0 = A[0, 0], A[0, 1], A[0, 2], A[0, 3]
    a10, a11, a12, b1 = A[1, 0], A[1, 1], A[1, 2], A[1, 3]
    a20, a21, a22, b2 = A[2, 0], A[2, 1], A[2, 2], A[2, 3]
    for n in range(len(floors)):
        x, y, z = boxes[0, n], boxes[1, n], boxes[2, n]
        ex, ey, ez = boxes[3, n], boxes[4, n], boxes[5, n]
        u = a00 * x + a01 * y + a02 * z + b0
        v = a10 * x + a11 * y + a12 * z + b1
        w = a20 * x + a21 * y + a22 * z + b2
        i, j, k = np.int32(u), np.int32(v), np.int32(w)
        fx, fy, fz = u - np.float32(i), v - np.float32(j), w - np.float32(k)
        a, b, c = np.uint32(i), np.uint32(j), np.uint32(k)
        phi, gx, gy, gz = in_cell(flat, a * sx + b * sy + c, sx, sy, fx, fy, fz)
        slope = ex * abs(gx * a00 + gy * a10 + gz * a20)
        slope += ey * abs(gx * a01 + gy * a11 + gz * a21)
        slope += ez * abs(gx * a02 + gy * a12 + gz * a22)
        dx = ex * abs(a00) + ey * abs(a01) + ez * abs(a02)
        dy = ex * abs(a10) + ey * abs(a11) + ez * abs(a12)
        dz = ex * abs(a20) + ey * abs(a21) + ez * abs(a22)
        at = np.uint32(6) * (((a >> shift) * by + (b >> shift)) * bz + (c >> shift))
        bend = bounds[at] * dx * (one + half * dx)
        bend += bounds[at + np.uint32(1)] * dy * (one + half * dy)
        bend += bounds[at + np.uint32(2)] * dz * (one + half * dz)
        bend += bounds[at + np.uint32(3)] * dx * dy
        bend += bounds[at + np.uint32(4)] * dx * dz
        bend += bounds[at + np.uint32(5)] * dy * dz
        floors[n] = max(floors[n], (phi - slope - bend) + margin)


@inlined_fast
def in_cell(flat: Any, at: Any, sx: Any, sy: Any, fx: Any, fy: Any, fz: Any) -> Any:
    """Trilinear value in the cell whose first node is ``at``, at fractions fx, fy, fz, and its change per cell."""
    one = np.uint32(1)
    v000, v001 = flat[at], flat[at + one]
    v010, v011 = flat[at + sy], flat[at + sy + one]
    v100, v101 = flat[at + sx], flat[at + sx + one]
    v110, v111 = flat[at + sx + sy], flat[at + sx + sy + one]
    v00, v01 = v000 + fz * (v001 - v000), v010 + fz * (v011 - v010)
    v10, v11 = v100 + fz * (v101 - v100), v110 + fz * (v111 - v110)
    v0, v1 = v00 + fy * (v01 - v00), v10 + fy * (v11 - v10)
    gy = (v01 - v00) + fx * ((v11 - v10) - (v01 - v00))
    dz0 = (v001 - v000) + fy * ((v011 - v010) - (v001 - v000))
    dz1 = (v101 - v100) + fy * ((v111 - v110) - (v101 - v100))
    return v0 + fx * (v1 - v0), v1 - v0, gy, dz0 + fx * (dz1 - dz0)
