# SPDX-License-Identifier: MIT
"""Distances and lower bounds in single precision, several at a time, wrong by a known rounding (see ``placement``).

A pad's pose comes as the map A p from the pad's frame to cells of the grid, ``A`` (3, 4) float32. The loops' only
branch asks whether the pad is inside the grid: the compiler makes two loops of it, which work on eight points or tiles
at once.
"""

from __future__ import annotations

from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from ...compiled import inlined_fast
from .field import Field

T = TypeVar("T", np.float32, np.float64)


@inlined_fast
def clamped(x: np.float32, most: np.float32) -> np.float32:
    """The nearest number between 0 and ``most``."""
    positive = x if x > np.float32(0) else np.float32(0)
    return positive if positive < most else most


@inlined_fast
def cell_of(u: np.float32, nodes: int) -> np.int32:
    """The cell that a coordinate is in, given how many nodes there are along its axis."""
    cell, last = np.int32(u), np.int32(nodes - 2)
    return cell if cell < last else last


@inlined_fast
def tile_distances(
    field: Field,
    A: NDArray[np.float32],
    inside: bool,
    coordinates: NDArray[np.float32],
    begin: int,
    distances: NDArray[np.float32],
) -> np.float32:
    """The least distance of a tile's points [m]; all of them go into ``distances`` (TILE,).

    Args:
        field: The field.
        A: The map from the pad's frame to cells.
        inside: Whether the pad is inside the grid.
        coordinates: Points in the pad's frame [m], shape (3, T * TILE).
        begin: The tile's first point.
        distances: Receives the distances.
    """
    values, scale = field.values, field.scale
    nx, ny, nz = values.shape
    hx, hy, hz = np.float32(1 / scale[0]), np.float32(1 / scale[1]), np.float32(1 / scale[2])
    a00, a01, a02, b0 = A[0, 0], A[0, 1], A[0, 2], A[0, 3]
    a10, a11, a12, b1 = A[1, 0], A[1, 1], A[1, 2], A[1, 3]
    a20, a21, a22, b2 = A[2, 0], A[2, 1], A[2, 2], A[2, 3]
    for n in range(len(distances)):
        x, y, z = coordinates[0, begin + n], coordinates[1, begin + n], coordinates[2, begin + n]
        u = a00 * x + a01 * y + a02 * z + b0
        v = a10 * x + a11 * y + a12 * z + b1
        w = a20 * x + a21 * y + a22 * z + b2
        if inside:
            i, j, k = np.int32(u), np.int32(v), np.int32(w)
            fx, fy, fz = u - np.float32(i), v - np.float32(j), w - np.float32(k)
            distances[n] = value_in_cell(values, i, j, k, fx, fy, fz)
        else:
            cu = clamped(u, np.float32(nx - 1))
            cv = clamped(v, np.float32(ny - 1))
            cw = clamped(w, np.float32(nz - 1))
            i = cell_of(cu, nx)
            j = cell_of(cv, ny)
            k = cell_of(cw, nz)
            fx, fy, fz = cu - np.float32(i), cv - np.float32(j), cw - np.float32(k)
            phi = value_in_cell(values, i, j, k, fx, fy, fz)
            dx, dy, dz = (u - cu) * hx, (v - cv) * hy, (w - cw) * hz
            distances[n] = phi + np.sqrt(dx * dx + dy * dy + dz * dz)
    return least(distances)


@inlined_fast
def value_in_cell(
    values: NDArray[np.float32],
    i: np.int32,
    j: np.int32,
    k: np.int32,
    fx: np.float32,
    fy: np.float32,
    fz: np.float32,
) -> np.float32:
    """Trilinear value [m] in cell (i, j, k), at fractions fx, fy, fz."""
    one = np.uint32(1)
    i0, j0, k0 = np.uint32(i), np.uint32(j), np.uint32(k)
    i1, j1, k1 = i0 + one, j0 + one, k0 + one
    v000, v001 = values[i0, j0, k0], values[i0, j0, k1]
    v010, v011 = values[i0, j1, k0], values[i0, j1, k1]
    v100, v101 = values[i1, j0, k0], values[i1, j0, k1]
    v110, v111 = values[i1, j1, k0], values[i1, j1, k1]
    v00, v01 = v000 + fz * (v001 - v000), v010 + fz * (v011 - v010)
    v10, v11 = v100 + fz * (v101 - v100), v110 + fz * (v111 - v110)
    v0, v1 = v00 + fy * (v01 - v00), v10 + fy * (v11 - v10)
    phi: np.float32 = v0 + fx * (v1 - v0)
    return phi


@inlined_fast
def least(values: NDArray[T]) -> T:
    """Least of some values, none of them NaN."""
    found: T = values[0]
    for n in range(1, len(values)):
        found = values[n] if values[n] < found else found
    return found


@inlined_fast
def tile_bounds(
    field: Field,
    A: NDArray[np.float32],
    inside: bool,
    boxes: NDArray[np.float32],
    first: int,
    bounds: NDArray[np.float32],
) -> None:
    """Lower bounds of tiles' distances into ``bounds`` (M,) [m], from the field's linear lower bounds.

    With m(u) = offset + g^T u the linear bound at a tile's centre c, and e its half extents in the pad's frame, no
    point of a tile inside the grid is nearer than

        m(A c) - sum_a e_a |sum_i g_i A_ia| .

    Outside, moving into the grid what is beyond it brings no two places farther apart along an axis. So with d_i =
    sum_a |A_ia| e_a the points of a tile are moved to within d of its moved centre c, and what they lose is at least
    the centre's distance beyond the grid less the tile's radius:

        phi >= m(c) - sum_i d_i |g_i| + max(0, beyond(A c) - |e|) .

    Args:
        field: The field.
        A: The map from the pad's frame to cells.
        inside: Whether the pad is inside the grid.
        boxes: Centres and half extents of tiles in the pad's frame [m], shape (6, T).
        first: The first of the tiles.
        bounds: Receives the bounds.
    """
    planes, scale, shift, zero = field.planes, field.scale, np.uint32(field.shift), np.float32(0)
    nx, ny, nz = field.values.shape
    hx, hy, hz = np.float32(1 / scale[0]), np.float32(1 / scale[1]), np.float32(1 / scale[2])
    a00, a01, a02, b0 = A[0, 0], A[0, 1], A[0, 2], A[0, 3]
    a10, a11, a12, b1 = A[1, 0], A[1, 1], A[1, 2], A[1, 3]
    a20, a21, a22, b2 = A[2, 0], A[2, 1], A[2, 2], A[2, 3]
    for n in range(len(bounds)):
        x, y, z = boxes[0, first + n], boxes[1, first + n], boxes[2, first + n]
        ex, ey, ez = boxes[3, first + n], boxes[4, first + n], boxes[5, first + n]
        u = a00 * x + a01 * y + a02 * z + b0
        v = a10 * x + a11 * y + a12 * z + b1
        w = a20 * x + a21 * y + a22 * z + b2
        if inside:
            i = np.uint32(np.int32(u)) >> shift
            j = np.uint32(np.int32(v)) >> shift
            k = np.uint32(np.int32(w)) >> shift
            gx, gy, gz = planes[i, j, k, 1], planes[i, j, k, 2], planes[i, j, k, 3]
            slope = ex * abs(gx * a00 + gy * a10 + gz * a20)
            slope += ey * abs(gx * a01 + gy * a11 + gz * a21)
            slope += ez * abs(gx * a02 + gy * a12 + gz * a22)
            bounds[n] = planes[i, j, k, 0] + gx * u + gy * v + gz * w - slope
        else:
            cu = clamped(u, np.float32(nx - 1))
            cv = clamped(v, np.float32(ny - 1))
            cw = clamped(w, np.float32(nz - 1))
            i = np.uint32(cell_of(cu, nx)) >> shift
            j = np.uint32(cell_of(cv, ny)) >> shift
            k = np.uint32(cell_of(cw, nz)) >> shift
            gx, gy, gz = planes[i, j, k, 1], planes[i, j, k, 2], planes[i, j, k, 3]
            slope = abs(gx) * (ex * abs(a00) + ey * abs(a01) + ez * abs(a02))
            slope += abs(gy) * (ex * abs(a10) + ey * abs(a11) + ez * abs(a12))
            slope += abs(gz) * (ex * abs(a20) + ey * abs(a21) + ez * abs(a22))
            dx, dy, dz = (u - cu) * hx, (v - cv) * hy, (w - cw) * hz
            beyond = np.sqrt(dx * dx + dy * dy + dz * dz) - np.sqrt(ex * ex + ey * ey + ez * ez)
            bounds[n] = (
                planes[i, j, k, 0]
                + gx * cu
                + gy * cv
                + gz * cw
                - slope
                + (beyond if beyond > zero else zero)
            )
