# SPDX-License-Identifier: MIT
r"""The compiled search for each pad's closest point: exactly the plain search's answer, with less looking.

The plain search takes the distance of every grid point of every pad, in double precision, at every pose. Here

- each pad's points are cut into tiles of ``TILE`` neighbours. A tile is looked at in single precision, several
  times faster per point, and what follows from that for later poses is remembered as its ``floor``: when the pad
  has moved, no point of it can have come closer by more than L x (the displacement of the pad's farthest corner),
  L being the field's Lipschitz constant. These add up in ``travel``, so a tile's least distance is at least
  floor - travel at any later pose;
- a tile is looked at again only where that bound is not above the best distance found so far, first of all the
  distance now of the point that was the closest. The optimiser's steps shrink quickly, and so does this set;
- a pad that reports no contact matters only where phi < 0: there the best so far is 0 from the start;
- only points within the rounding of single precision of the best are evaluated in double precision.

Every bound includes that rounding, so no shortcut changes a result.

Arguments are plain arrays, many of them: bundled in tuples they cost half as much again as the search itself.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiled import compiled, compiled_fast
from .kernels import trilinear

TILE = 16  # points looked at together: two vectors of eight
ROUNDING = (
    2.0**-17
)  # bound of a single-precision distance's error, per metre of distance and of reach


@compiled
def closest_on_pads(
    T_wo: Any,
    T_wp: Any,
    wanted: Any,
    values: Any,
    lower: Any,
    scale: Any,
    lipschitz: Any,
    largest: float,
    points: Any,
    corners: Any,
    order: Any,
    tiles: Any,
    tile_offsets: Any,
    near: Any,
    floor: Any,
    travel: Any,
    last: Any,
    seen_R: Any,
    seen_t: Any,
    seen_inside: Any,
) -> Any:
    """Grid point of least distance on each pad, at one object pose.

    Args:
        T_wo: Object pose, (4, 4).
        T_wp: Pad poses, (K, 4, 4).
        wanted: Pads whose distance is wanted whatever it is, (K,); of the others only if negative.
        values: Distances at the grid's nodes, and with the next two the grid (see ``kernels``).
        lower: Position of the first node.
        scale: Cells per metre.
        lipschitz: Lipschitz constants of the field, inside the grid and anywhere, (2,).
        largest: Largest absolute value of a node.
        points: All pads' points, each in its pad's frame, (P, 3).
        corners: Corners of the box around each pad's points, in its frame, (K, 4, 3) or (K, 8, 3).
        order: Which points the tiles hold, (N * TILE,).
        tiles: Their coordinates in single precision, (3, N * TILE).
        tile_offsets: Pad k's tiles are tile_offsets[k] to tile_offsets[k + 1].
        near: Room for the distances of one tile, (TILE,) float32.
        floor: Memory: what each tile's least distance was at least, plus the travel then, (N,).
        travel: Memory: how much nearer any point of the pad can have come since the beginning [m], (K,).
        last: Memory: the last closest points, (K,).
        seen_R: Memory: rotation of T_op at the last pose, (K, 3, 3).
        seen_t: Memory: its translation, (K, 3); infinite where there is none yet.
        seen_inside: Memory: whether all the pad's points were inside the grid there, (K,).

    Returns:
        Distances (K,), Jacobians for a right perturbation of T_wo (K, 6), indices into the points (K,). Of equal
        distances the first point counts. Infinite, zero and -1 for a pad that is not wanted and does not reach
        into the object.
    """
    count, flat, cell = len(T_wp), values.ravel(), (1.0 / scale).astype(np.float32)
    distances = np.full(count, np.inf)
    jacobians = np.zeros((count, 6))
    indices = np.full(count, -1)
    for k in range(count):
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
        travel[k] += moved
        seen_R[k], seen_t[k], seen_inside[k] = R, t, inside
        first, behind = tile_offsets[k], tile_offsets[k + 1]
        if not wanted[k] and floor[first:behind].min() > travel[k]:
            continue
        A, b = to_cells(lower, scale, R, t)
        best, at = distance_at(values, lower, scale, R, t, points[last[k]]), last[k]
        for tile in range(first, behind):
            bound = best if wanted[k] else min(best, 0.0)
            if floor[tile] - travel[k] > bound:
                continue
            least = look(flat, values.shape, cell, A, b, tiles, tile * TILE, inside, near)
            floor[tile] = least - rounding + travel[k]
            if least - rounding > bound:
                continue
            for n in range(TILE):
                if near[n] - rounding <= bound:
                    index = order[tile * TILE + n]
                    phi = distance_at(values, lower, scale, R, t, points[index])
                    if phi < best or (phi == best and index < at):
                        best, at = phi, index
                        bound = min(bound, best)
        last[k] = at
        if wanted[k] or best < 0:
            distances[k], indices[k] = best, at
            jacobians[k] = jacobian_at(values, lower, scale, R, t, points[at])
    return distances, jacobians, indices


@compiled
def distance_at(values: Any, lower: Any, scale: Any, R: Any, t: Any, p: Any) -> float:
    """Distance of the point R p + t."""
    x, y, z = transform(R, t, p)
    return trilinear(values, lower, scale, x, y, z)[0]  # type: ignore[no-any-return]


@compiled
def jacobian_at(values: Any, lower: Any, scale: Any, R: Any, t: Any, p: Any) -> Any:
    """dphi/dxi = grad phi^T [skew(p_o) -I] = [(grad phi x p_o)^T  -grad phi^T], shape (6,)."""
    x, y, z = transform(R, t, p)
    _, gx, gy, gz = trilinear(values, lower, scale, x, y, z)
    return np.array([gy * z - gz * y, gz * x - gx * z, gx * y - gy * x, -gx, -gy, -gz])


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
    twice the 64 x 2^-24 that covers these.

    moved: Most that a point's distance differs from that at the pose seen last [m], 0 where none was. The
    difference of two affine maps is affine and its norm convex: the largest is at a corner.
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
    rounding = ROUNDING * lipschitz[1] * (largest + reach + size)
    if not np.isfinite(seen_t[0]):
        return inside, rounding, 0.0
    slope = lipschitz[0] if inside and seen_inside else lipschitz[1]
    return inside, rounding, slope * np.sqrt(step)


@compiled
def to_cells(lower: Any, scale: Any, R: Any, t: Any) -> Any:
    """The map A p + b from the pad's frame to cells of the grid, in single precision, (3, 3) and (3,)."""
    A = np.empty((3, 3), np.float32)
    b = np.empty(3, np.float32)
    for i in range(3):
        for j in range(3):
            A[i, j] = R[i, j] * scale[i]
        b[i] = (t[i] - lower[i]) * scale[i]
    return A, b


@compiled
def look(
    flat: Any,
    shape: Any,
    cell: Any,
    A: Any,
    b: Any,
    tiles: Any,
    begin: int,
    inside: bool,
    near: Any,
) -> float:
    """Single-precision distances of the tile's points from ``begin`` into ``near`` (TILE,); returns the least."""
    if inside:
        look_inside(flat, shape[1], shape[2], A, b, tiles, begin, near)
    else:
        look_anywhere(flat, shape, cell, A, b, tiles, begin, near)
    return least_of(near)  # type: ignore[no-any-return]


@compiled_fast
def least_of(near: Any) -> float:
    """Least of TILE values."""
    least = near[0]
    for n in range(1, len(near)):
        least = near[n] if near[n] < least else least
    return least  # type: ignore[no-any-return]


@compiled_fast
def look_inside(
    flat: Any, ny: int, nz: int, A: Any, b: Any, tiles: Any, begin: int, near: Any
) -> None:
    """Distances of points that are all inside the grid: no branch, so that the compiler vectorises."""
    sx, sy = np.uint32(ny * nz), np.uint32(nz)
    a00, a01, a02, b0 = A[0, 0], A[0, 1], A[0, 2], b[0]
    a10, a11, a12, b1 = A[1, 0], A[1, 1], A[1, 2], b[1]
    a20, a21, a22, b2 = A[2, 0], A[2, 1], A[2, 2], b[2]
    for n in range(len(near)):
        x, y, z = tiles[0, begin + n], tiles[1, begin + n], tiles[2, begin + n]
        u = a00 * x + a01 * y + a02 * z + b0
        v = a10 * x + a11 * y + a12 * z + b1
        w = a20 * x + a21 * y + a22 * z + b2
        i, j, k = np.int32(u), np.int32(v), np.int32(w)
        at = np.uint32(i) * sx + np.uint32(j) * sy + np.uint32(k)
        near[n] = cell_value(
            flat, at, sx, sy, u - np.float32(i), v - np.float32(j), w - np.float32(k)
        )


@compiled_fast
def look_anywhere(
    flat: Any, shape: Any, cell: Any, A: Any, b: Any, tiles: Any, begin: int, near: Any
) -> None:
    """Distances of points inside or outside the grid."""
    nx, ny, nz = shape
    sx, sy = np.uint32(ny * nz), np.uint32(nz)
    zero, hx, hy, hz = np.float32(0), cell[0], cell[1], cell[2]
    a00, a01, a02, b0 = A[0, 0], A[0, 1], A[0, 2], b[0]
    a10, a11, a12, b1 = A[1, 0], A[1, 1], A[1, 2], b[1]
    a20, a21, a22, b2 = A[2, 0], A[2, 1], A[2, 2], b[2]
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
        phi = cell_value(
            flat, at, sx, sy, cu - np.float32(i), cv - np.float32(j), cw - np.float32(k)
        )
        dx, dy, dz = (u - cu) * hx, (v - cv) * hy, (w - cw) * hz
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
