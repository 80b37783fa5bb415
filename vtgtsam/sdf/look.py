# SPDX-License-Identifier: MIT
"""Distances and bounds in single precision, several points at a time, wrong by a known rounding.

A pad's pose comes as the map A p from the pad's frame to cells of the grid, ``A`` (3, 4) float32. No loop has a branch,
so that the compiler works on eight points or tiles at once.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiled import inlined, inlined_fast


@inlined
def look(
    flat: Any, shape: Any, cell: Any, A: Any, coordinates: Any, begin: int, inside: bool, near: Any
) -> Any:
    """Distances of a tile's points into ``near`` (TILE,); returns the least.

    Args:
        flat: Distances at the grid's nodes.
        shape: Numbers of nodes.
        cell: Sides of a cell [m], (3,) float32.
        A: The map from the pad's frame to cells.
        coordinates: Points in the pad's frame, (3, T * TILE).
        begin: The tile's first point.
        inside: Whether the pad is inside the grid.
        near: Room for the distances.
    """
    if inside:
        look_inside(flat, shape, A, coordinates, begin, near)
    else:
        look_anywhere(flat, shape, cell, A, coordinates, begin, near)
    return least(near)


@inlined_fast
def least(values: Any) -> Any:
    """Least of some values, none of them NaN."""
    found = values[0]
    for n in range(1, len(values)):
        found = values[n] if values[n] < found else found
    return found


@inlined_fast
def look_inside(flat: Any, shape: Any, A: Any, coordinates: Any, begin: int, near: Any) -> None:
    """Distances of points that are all inside the grid."""
    sx, sy = np.uint32(shape[1] * shape[2]), np.uint32(shape[2])
    a00, a01, a02, b0 = A[0, 0], A[0, 1], A[0, 2], A[0, 3]
    a10, a11, a12, b1 = A[1, 0], A[1, 1], A[1, 2], A[1, 3]
    a20, a21, a22, b2 = A[2, 0], A[2, 1], A[2, 2], A[2, 3]
    for n in range(len(near)):
        x, y, z = coordinates[0, begin + n], coordinates[1, begin + n], coordinates[2, begin + n]
        u = a00 * x + a01 * y + a02 * z + b0
        v = a10 * x + a11 * y + a12 * z + b1
        w = a20 * x + a21 * y + a22 * z + b2
        i, j, k = np.int32(u), np.int32(v), np.int32(w)
        at = np.uint32(i) * sx + np.uint32(j) * sy + np.uint32(k)
        near[n] = value_in_cell(
            flat, at, sx, sy, u - np.float32(i), v - np.float32(j), w - np.float32(k)
        )


@inlined_fast
def look_anywhere(
    flat: Any, shape: Any, cell: Any, A: Any, coordinates: Any, begin: int, near: Any
) -> None:
    """Distances of points inside or outside the grid."""
    nx, ny, nz = shape
    sx, sy = np.uint32(ny * nz), np.uint32(nz)
    zero, hx, hy, hz = np.float32(0), cell[0], cell[1], cell[2]
    a00, a01, a02, b0 = A[0, 0], A[0, 1], A[0, 2], A[0, 3]
    a10, a11, a12, b1 = A[1, 0], A[1, 1], A[1, 2], A[1, 3]
    a20, a21, a22, b2 = A[2, 0], A[2, 1], A[2, 2], A[2, 3]
    for n in range(len(near)):
        x, y, z = coordinates[0, begin + n], coordinates[1, begin + n], coordinates[2, begin + n]
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
        phi = value_in_cell(
            flat, at, sx, sy, cu - np.float32(i), cv - np.float32(j), cw - np.float32(k)
        )
        dx, dy, dz = (u - cu) * hx, (v - cv) * hy, (w - cw) * hz
        near[n] = phi + np.sqrt(dx * dx + dy * dy + dz * dz)


@inlined_fast
def value_in_cell(flat: Any, at: Any, sx: Any, sy: Any, fx: Any, fy: Any, fz: Any) -> Any:
    """Trilinear value in the cell whose first node is ``at``, at fractions fx, fy, fz."""
    one = np.uint32(1)
    v000, v001 = flat[at], flat[at + one]
    v010, v011 = flat[at + sy], flat[at + sy + one]
    v100, v101 = flat[at + sx], flat[at + sx + one]
    v110, v111 = flat[at + sx + sy], flat[at + sx + sy + one]
    v00, v01 = v000 + fz * (v001 - v000), v010 + fz * (v011 - v010)
    v10, v11 = v100 + fz * (v101 - v100), v110 + fz * (v111 - v110)
    v0, v1 = v00 + fy * (v01 - v00), v10 + fy * (v11 - v10)
    return v0 + fx * (v1 - v0)


@inlined_fast
def bound_inside(
    flat: Any, blocks: Any, shift: Any, A: Any, boxes: Any, first: int, count: int, low: Any
) -> None:
    """What minorants say of tiles that are all inside the grid, into ``low`` (count,).

    With m(u) = offset + g^T u the minorant at a tile's centre c, and e its half extents in the pad's frame, no point of
    it is nearer than

        m(A c) - sum_a e_a |sum_i g_i A_ia| .

    Args:
        flat: Offsets and slopes of the blocks' minorants, four numbers each (see ``minorants``).
        blocks: Numbers of blocks.
        shift: Logarithm to base 2 of a block's side in cells.
        A: The map from the pad's frame to cells.
        boxes: Centres and half extents of tiles, (6, T).
        first: The pad's first tile.
        count: How many tiles it has.
        low: Receives the bounds.
    """
    by, bz = np.uint32(blocks[1]), np.uint32(blocks[2])
    shift, four, one = np.uint32(shift), np.uint32(4), np.uint32(1)
    a00, a01, a02, b0 = A[0, 0], A[0, 1], A[0, 2], A[0, 3]
    a10, a11, a12, b1 = A[1, 0], A[1, 1], A[1, 2], A[1, 3]
    a20, a21, a22, b2 = A[2, 0], A[2, 1], A[2, 2], A[2, 3]
    for n in range(count):
        x, y, z = boxes[0, first + n], boxes[1, first + n], boxes[2, first + n]
        ex, ey, ez = boxes[3, first + n], boxes[4, first + n], boxes[5, first + n]
        u = a00 * x + a01 * y + a02 * z + b0
        v = a10 * x + a11 * y + a12 * z + b1
        w = a20 * x + a21 * y + a22 * z + b2
        i = np.uint32(np.int32(u)) >> shift
        j = np.uint32(np.int32(v)) >> shift
        k = np.uint32(np.int32(w)) >> shift
        at = four * ((i * by + j) * bz + k)
        gx, gy, gz = flat[at + one], flat[at + one + one], flat[at + one + one + one]
        slope = ex * abs(gx * a00 + gy * a10 + gz * a20)
        slope += ey * abs(gx * a01 + gy * a11 + gz * a21)
        slope += ez * abs(gx * a02 + gy * a12 + gz * a22)
        low[n] = flat[at] + gx * u + gy * v + gz * w - slope


@inlined_fast
def bound_anywhere(
    flat: Any,
    blocks: Any,
    shift: Any,
    shape: Any,
    cell: Any,
    A: Any,
    boxes: Any,
    first: int,
    count: int,
    low: Any,
) -> None:
    """The same for tiles inside or outside the grid, not as tight.

    Moving into the grid what is beyond it brings no two places farther apart along an axis. So with d_i = sum_a
    |A_ia| e_a the points of a tile are moved to within d of its moved centre c, and what they lose is at least the
    centre's distance beyond the grid less the tile's radius:

        phi >= m(c) - sum_i d_i |g_i| + max(0, beyond(A c) - |e|) .

    Further arguments:
        shape: Numbers of nodes.
        cell: Sides of a cell [m], (3,) float32.
    """
    nx, ny, nz = shape
    by, bz = np.uint32(blocks[1]), np.uint32(blocks[2])
    shift, four, one, zero = np.uint32(shift), np.uint32(4), np.uint32(1), np.float32(0)
    hx, hy, hz = cell[0], cell[1], cell[2]
    a00, a01, a02, b0 = A[0, 0], A[0, 1], A[0, 2], A[0, 3]
    a10, a11, a12, b1 = A[1, 0], A[1, 1], A[1, 2], A[1, 3]
    a20, a21, a22, b2 = A[2, 0], A[2, 1], A[2, 2], A[2, 3]
    for n in range(count):
        x, y, z = boxes[0, first + n], boxes[1, first + n], boxes[2, first + n]
        ex, ey, ez = boxes[3, first + n], boxes[4, first + n], boxes[5, first + n]
        u = a00 * x + a01 * y + a02 * z + b0
        v = a10 * x + a11 * y + a12 * z + b1
        w = a20 * x + a21 * y + a22 * z + b2
        cu = min(max(u, zero), np.float32(nx - 1))
        cv = min(max(v, zero), np.float32(ny - 1))
        cw = min(max(w, zero), np.float32(nz - 1))
        i = np.uint32(min(np.int32(cu), np.int32(nx - 2))) >> shift
        j = np.uint32(min(np.int32(cv), np.int32(ny - 2))) >> shift
        k = np.uint32(min(np.int32(cw), np.int32(nz - 2))) >> shift
        at = four * ((i * by + j) * bz + k)
        gx, gy, gz = flat[at + one], flat[at + one + one], flat[at + one + one + one]
        slope = abs(gx) * (ex * abs(a00) + ey * abs(a01) + ez * abs(a02))
        slope += abs(gy) * (ex * abs(a10) + ey * abs(a11) + ez * abs(a12))
        slope += abs(gz) * (ex * abs(a20) + ey * abs(a21) + ez * abs(a22))
        dx, dy, dz = (u - cu) * hx, (v - cv) * hy, (w - cw) * hz
        beyond = np.sqrt(dx * dx + dy * dy + dz * dz) - np.sqrt(ex * ex + ey * ey + ez * ez)
        low[n] = flat[at] + gx * cu + gy * cv + gz * cw - slope + max(beyond, zero)
