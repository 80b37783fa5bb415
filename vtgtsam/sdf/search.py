# SPDX-License-Identifier: MIT
r"""The compiled search for each pad's closest point: exactly the plain search's answer, with less looking.

The plain search takes the distance of every grid point of every pad, in double precision, at every pose. Here

- all points of a pad are first looked at in single precision, about six times faster per point; only those
  within twice the rounding bound of the least are evaluated in double precision;
- the single-precision distances ``near`` are kept with the pose they belong to. At another pose each may have
  changed by at most ``moved`` = L x (the largest displacement of the pad's corners), L being the field's
  Lipschitz constant, so only points with near <= phi(the last closest point) + moved can be the closest. The
  optimiser's steps shrink quickly, and so does this set; where it stays large, all points are looked at again;
- a pad that reports no contact matters only where phi < 0: it is left out while near > moved everywhere.

Every bound includes the rounding of the single-precision pass, so no shortcut changes a result.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiled import compiled, compiled_fast
from .kernels import trilinear

LOOK_AGAIN = 8  # all points are looked at again where more than 1 / LOOK_AGAIN of them remain
ROUNDING = 2.0**-18  # bound of the single-precision pass, per metre of distance and of reach
BLOCK = 64  # points skipped at once where none can be the closest


@compiled
def closest_on_pads(
    values: Any,
    lower: Any,
    scale: Any,
    lipschitz: Any,
    largest: float,
    T_wo: Any,
    T_wp: Any,
    points_p: Any,
    points32: Any,
    offsets: Any,
    corners: Any,
    wanted: Any,
    near: Any,
    least: Any,
    last: Any,
    seen_R: Any,
    seen_t: Any,
    seen_inside: Any,
) -> Any:
    """Grid point of least distance on each pad, at one object pose.

    Args:
        values: Distances at the grid's nodes, and with the next two the grid (see ``kernels``).
        lower: Position of the first node.
        scale: Cells per metre.
        lipschitz: Lipschitz constants of the field, inside the grid and anywhere, (2,).
        largest: Largest absolute value of a node.
        T_wo: Object pose, (4, 4).
        T_wp: Pad poses, (K, 4, 4).
        points_p: All pads' points, each in its pad's frame, (P, 3).
        points32: The same in single precision, (3, P).
        offsets: Pad k's points are offsets[k] to offsets[k + 1].
        corners: Corners of the box around each pad's points, in its frame, (K, 4, 3) or (K, 8, 3).
        wanted: Pads whose distance is wanted whatever it is, (K,); of the others only if negative.
        near: Memory: single-precision distances at the pose last looked at, (P,).
        least: Memory: the least of them, (K,).
        last: Memory: the last closest points, (K,).
        seen_R: Memory: rotation of T_op that ``near`` belongs to, (K, 3, 3).
        seen_t: Memory: its translation, (K, 3); infinite where there is none yet.
        seen_inside: Memory: whether all the pad's points were inside the grid there, (K,).

    Returns:
        Distances (K,), Jacobians for a right perturbation of T_wo (K, 6), indices into points_p (K,). Of equal
        distances the first point counts. Infinite, zero and -1 for a pad that is not wanted and does not reach
        into the object.
    """
    count = len(T_wp)
    distances = np.full(count, np.inf)
    jacobians = np.zeros((count, 6))
    indices = np.full(count, -1)
    for k in range(count):
        begin, end = offsets[k], offsets[k + 1]
        R, t = relative_pose(T_wo, T_wp[k])
        inside, rounding, moved = bounds_of_pad(
            values.shape,
            lower,
            scale,
            lipschitz,
            largest,
            R,
            t,
            seen_R[k],
            seen_t[k],
            seen_inside[k],
            corners[k],
        )
        if not wanted[k] and least[k] > moved:
            continue
        limit = np.inf
        if moved < np.inf:
            p = points_p[last[k]]
            x, y, z = transform(R, t, p)
            bound = trilinear(values, lower, scale, x, y, z)[0]
            limit = moved + (bound if wanted[k] else min(bound, 0.0))
        if count_up_to(near, begin, end, np.float32(limit)) * LOOK_AGAIN > end - begin:
            least[k] = look(values, lower, scale, R, t, points32, begin, end, inside, near)
            seen_R[k], seen_t[k], seen_inside[k] = R, t, inside
            if not wanted[k] and least[k] > rounding:
                continue
            limit = least[k] + 2 * rounding
        best, at = nearest_of(values, lower, scale, R, t, points_p, begin, end, near, limit)
        last[k] = at if at >= 0 else last[k]
        if at < 0 or (not wanted[k] and best >= 0):
            continue
        distances[k], indices[k] = best, at
        x, y, z = transform(R, t, points_p[at])
        _, gx, gy, gz = trilinear(values, lower, scale, x, y, z)
        # dphi/dxi = grad phi^T [skew(p_o) -I] = [(grad phi x p_o)^T  -grad phi^T]
        jacobians[k, 0] = gy * z - gz * y
        jacobians[k, 1] = gz * x - gx * z
        jacobians[k, 2] = gx * y - gy * x
        jacobians[k, 3], jacobians[k, 4], jacobians[k, 5] = -gx, -gy, -gz
    return distances, jacobians, indices


@compiled
def nearest_of(
    values: Any,
    lower: Any,
    scale: Any,
    R: Any,
    t: Any,
    points_p: Any,
    begin: int,
    end: int,
    near: Any,
    limit: float,
) -> Any:
    """Least distance, in double precision, among points [begin, end) with near <= limit, and which it is."""
    limit32 = np.float32(limit)
    best, at = np.inf, -1
    for block in range(begin, end, BLOCK):
        stop = min(block + BLOCK, end)
        if count_up_to(near, block, stop, limit32) == 0:
            continue
        for n in range(block, stop):
            if near[n] <= limit32:
                x, y, z = transform(R, t, points_p[n])
                phi = trilinear(values, lower, scale, x, y, z)[0]
                if phi < best:
                    best, at = phi, n
    return best, at


@compiled
def relative_pose(T_wo: Any, T_wp: Any) -> Any:
    """Rotation (3, 3) and translation (3,) of T_op = T_wo^-1 T_wp."""
    R = np.empty((3, 3))
    t = np.empty(3)
    d0, d1, d2 = T_wp[0, 3] - T_wo[0, 3], T_wp[1, 3] - T_wo[1, 3], T_wp[2, 3] - T_wo[2, 3]
    for i in range(3):
        for j in range(3):
            R[i, j] = T_wo[0, i] * T_wp[0, j] + T_wo[1, i] * T_wp[1, j] + T_wo[2, i] * T_wp[2, j]
        t[i] = T_wo[0, i] * d0 + T_wo[1, i] * d1 + T_wo[2, i] * d2
    return R, t


@compiled
def transform(R: Any, t: Any, p: Any) -> Any:
    """Coordinates of R p + t."""
    x = R[0, 0] * p[0] + R[0, 1] * p[1] + R[0, 2] * p[2] + t[0]
    y = R[1, 0] * p[0] + R[1, 1] * p[1] + R[1, 2] * p[2] + t[1]
    z = R[2, 0] * p[0] + R[2, 1] * p[1] + R[2, 2] * p[2] + t[2]
    return x, y, z


@compiled
def points_in_world(T_wp: Any, points_p: Any, indices: Any) -> Any:
    """Point ``indices[k]`` of pad k in the world (K, 3); NaN where the index is -1."""
    points_w = np.full((len(indices), 3), np.nan)
    for k in range(len(indices)):
        if indices[k] >= 0:
            x, y, z = transform(T_wp[k], T_wp[k, :, 3], points_p[indices[k]])
            points_w[k, 0], points_w[k, 1], points_w[k, 2] = x, y, z
    return points_w


@compiled
def bounds_of_pad(
    shape: Any,
    lower: Any,
    scale: Any,
    lipschitz: Any,
    largest: float,
    R: Any,
    t: Any,
    seen_R: Any,
    seen_t: Any,
    seen_inside: bool,
    corners: Any,
) -> Any:
    """What holds for all points inside the box of ``corners``: (inside, rounding, moved).

    inside: The box is in the grid, by 0.01 cells, which is more than single precision can be wrong.

    rounding: Most that a single-precision distance is wrong [m]. A cell coordinate comes from 4 products and sums
    and as many rounded inputs, each wrong by 2^-24 of at most the pad's reach from the grid's first node; three
    axes together move phi by less than 28 L 2^-24 reach. Seven linear interpolations of three operations add less
    than 48 x 2^-24 of the largest value, the distance beyond the grid less than 8 x 2^-24 reach. ``ROUNDING`` is
    64 x 2^-24. The last factor 2 covers the comparisons with a limit rounded to single precision.

    moved: Most that a point's distance differs from its single-precision distance at the pose seen [m], infinite
    where none was. The difference of two affine maps is affine and its norm convex: the largest is at a corner.
    """
    inside, reach, size, step = True, 0.0, 0.0, 0.0
    for c in range(len(corners)):
        p = corners[c]
        x, y, z = transform(R, t, p)
        dx, dy, dz = x - lower[0], y - lower[1], z - lower[2]
        inside &= 0.01 < dx * scale[0] < shape[0] - 1.01
        inside &= 0.01 < dy * scale[1] < shape[1] - 1.01
        inside &= 0.01 < dz * scale[2] < shape[2] - 1.01
        reach = max(reach, abs(dx), abs(dy), abs(dz))
        size = max(size, abs(p[0]) + abs(p[1]) + abs(p[2]))
        a, b, d = transform(seen_R, seen_t, p)
        step = max(step, (x - a) ** 2 + (y - b) ** 2 + (z - d) ** 2)
    rounding = 2.0 * ROUNDING * lipschitz[1] * (largest + reach + size)
    slope = lipschitz[0] if inside and seen_inside else lipschitz[1]
    moved = slope * np.sqrt(step) + rounding if np.isfinite(seen_t[0]) else np.inf
    return inside, rounding, moved


@compiled
def count_up_to(near: Any, begin: int, end: int, limit: float) -> int:
    """How many of near[begin:end] are at most ``limit``."""
    if limit == np.inf:
        return end - begin
    count = 0
    for n in range(begin, end):
        count += near[n] <= limit
    return count


@compiled
def look(
    values: Any,
    lower: Any,
    scale: Any,
    R: Any,
    t: Any,
    points32: Any,
    begin: int,
    end: int,
    inside: bool,
    near: Any,
) -> float:
    """Single-precision distances of points [begin, end) into ``near``; returns the least."""
    shape = values.shape
    A = np.empty((3, 3), np.float32)  # metres in the pad's frame to cells
    b = np.empty(3, np.float32)
    for i in range(3):
        for j in range(3):
            A[i, j] = R[i, j] * scale[i]
        b[i] = (t[i] - lower[i]) * scale[i]
    flat = values.ravel()
    if inside:
        look_inside(flat, shape[1], shape[2], A, b, points32, begin, end, near)
    else:
        cell = (1.0 / scale).astype(np.float32)
        look_anywhere(flat, shape, cell, A, b, points32, begin, end, near)
    least = near[begin]
    for n in range(begin, end):
        least = min(least, near[n])
    return least  # type: ignore[no-any-return]


@compiled_fast
def look_inside(
    flat: Any, ny: int, nz: int, A: Any, b: Any, points: Any, begin: int, end: int, near: Any
) -> None:
    """Distances of points that are all inside the grid: no branch, so that the compiler vectorises."""
    sx, sy = np.uint32(ny * nz), np.uint32(nz)
    for n in range(begin, end):
        x, y, z = points[0, n], points[1, n], points[2, n]
        u = A[0, 0] * x + A[0, 1] * y + A[0, 2] * z + b[0]
        v = A[1, 0] * x + A[1, 1] * y + A[1, 2] * z + b[1]
        w = A[2, 0] * x + A[2, 1] * y + A[2, 2] * z + b[2]
        i, j, k = np.int32(u), np.int32(v), np.int32(w)
        at = np.uint32(i) * sx + np.uint32(j) * sy + np.uint32(k)
        near[n] = cell_value(
            flat, at, sx, sy, u - np.float32(i), v - np.float32(j), w - np.float32(k)
        )


@compiled_fast
def look_anywhere(
    flat: Any, shape: Any, cell: Any, A: Any, b: Any, points: Any, begin: int, end: int, near: Any
) -> None:
    """Distances of points inside or outside the grid."""
    nx, ny, nz = shape
    sx, sy = np.uint32(ny * nz), np.uint32(nz)
    zero = np.float32(0)
    for n in range(begin, end):
        x, y, z = points[0, n], points[1, n], points[2, n]
        u = A[0, 0] * x + A[0, 1] * y + A[0, 2] * z + b[0]
        v = A[1, 0] * x + A[1, 1] * y + A[1, 2] * z + b[1]
        w = A[2, 0] * x + A[2, 1] * y + A[2, 2] * z + b[2]
        cu = min(max(u, zero), np.float32(nx - 1))
        cv = min(max(v, zero), np.float32(ny - 1))
        cw = min(max(w, zero), np.float32(nz - 1))
        i = min(np.int32(cu), np.int32(nx - 2))
        j = min(np.int32(cv), np.int32(ny - 2))
        k = min(np.int32(cw), np.int32(nz - 2))
        at = np.uint32(i) * sx + np.uint32(j) * sy + np.uint32(k)
        phi = cell_value(
            flat, at, sx, sy, cu - np.float32(i), cv - np.float32(j), cw - np.float32(k)
        )
        dx, dy, dz = (u - cu) * cell[0], (v - cv) * cell[1], (w - cw) * cell[2]
        near[n] = phi + np.sqrt(dx * dx + dy * dy + dz * dz)


@compiled_fast
def cell_value(flat: Any, at: Any, sx: Any, sy: Any, fx: Any, fy: Any, fz: Any) -> Any:
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
