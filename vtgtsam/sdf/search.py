# SPDX-License-Identifier: MIT
r"""The compiled search for each pad's closest point: exactly the plain search's answer, with less looking.

The plain search takes the distance of every grid point of every pad, in double precision, at every pose. Here

- each pad's points are cut into tiles of ``TILE`` neighbours, and each tile has a ``floor``, which its least distance
  is not below. A floor stays good for later poses: when the pad has moved, no point of it has come closer by more than
  L x (the most that a point of it moved), L being the field's Lipschitz constant. These add up in ``travel``, and
  floor - travel is not above the tile's least distance at any later pose. Steps shrink quickly as an optimiser
  converges, and so does the set of tiles worth a look;
- a floor is raised by a look at the tile's centre: value, slope, and a bound of the field's curvature around it
  (see ``look.raise_floors``). On a smooth object six tiles of seven end there, even at a pose unlike any before;
- the tiles left, those with a floor not above the best distance found so far, are looked at in single precision,
  several times faster per point, the likeliest first; only points within its rounding of the best are evaluated in
  double precision;
- a pad that reports no contact matters only where phi < 0: there the best so far is 0 from the start.

Every bound includes the rounding of single precision, so no shortcut changes a result.

Arguments are plain arrays, many of them: bundled in tuples they cost half as much again as the search itself.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiled import compiled, inlined, inlined_fast
from .kernels import trilinear
from .look import least, look, raise_floors

TILE = 16  # points looked at together: two vectors of eight
FEW = 2  # tiles looked at without a look at the centres of all before
ROUNDING = (
    2.0**-17
)  # bound of a single-precision distance's error, per metre of distance and of reach


@compiled
def closest_on_pads(
    T_wo: Any,
    T_wp: Any,
    wanted: Any,
    values: Any,
    bends: Any,
    lower: Any,
    scale: Any,
    lipschitz: Any,
    largest: float,
    points: Any,
    pad_boxes: Any,
    order: Any,
    tiles: Any,
    tile_boxes: Any,
    tile_offsets: Any,
    near: Any,
    floor: Any,
    travel: Any,
    last: Any,
    seen: Any,
    seen_inside: Any,
) -> Any:
    """Grid point of least distance on each pad, at one object pose.

    Args:
        T_wo: Object pose, (4, 4).
        T_wp: Pad poses, (K, 4, 4).
        wanted: Pads whose distance is wanted whatever it is, (K,); of the others only if negative.
        values: Distances at the grid's nodes.
        bends: Bounds of their second differences (see ``bends``).
        lower: Position of the first node.
        scale: Cells per metre.
        lipschitz: Lipschitz constants of the field, inside the grid and anywhere, (2,).
        largest: Largest absolute value of a node.
        points: All pads' points, each in its pad's frame, (P, 3).
        pad_boxes: Centre and half extents of each pad's points, in its frame, (K, 2, 3).
        order: Which points the tiles hold, (N * TILE,).
        tiles: Their coordinates in single precision, (3, N * TILE).
        tile_boxes: Centre and half extents of each tile in single precision, (6, N).
        tile_offsets: Pad k's tiles are tile_offsets[k] to tile_offsets[k + 1].
        near: Room for the distances of one tile, (TILE,) float32.
        floor: Memory: what each tile's least distance was at least, plus the travel then, (N,).
        travel: Memory: how much nearer any point of the pad can have come since the beginning [m], (K,).
        last: Memory: the last closest points, (K,).
        seen: Memory: T_op at the last pose, (K, 3, 4); infinite where there is none yet.
        seen_inside: Memory: whether all the pad's points were inside the grid there, (K,).

    Returns:
        Distances (K,), Jacobians for a right perturbation of T_wo (K, 6), indices into the points (K,). Of equal
        distances the first point counts. Infinite, zero and -1 for a pad that is not wanted and does not reach
        into the object.
    """
    count = len(T_wp)
    distances = np.full(count, np.inf)
    jacobians = np.zeros((count, 6))
    indices = np.full(count, -1)
    flat, cell = values.ravel(), (1.0 / scale).astype(np.float32)
    T_op, A = np.empty((3, 4)), np.empty((3, 4), np.float32)
    for k in range(count):
        relative_pose(T_wo, T_wp[k], T_op)
        inside, rounding, moved = bounds_of_pad(
            values.shape,
            lower,
            scale,
            lipschitz,
            largest,
            T_op,
            seen[k],
            seen_inside[k],
            pad_boxes[k],
        )
        travel[k] += moved
        seen[k], seen_inside[k] = T_op, inside
        first, behind = tile_offsets[k], tile_offsets[k + 1]
        floors = floor[first:behind]
        if not wanted[k] and least(floors) > travel[k]:
            continue

        to_cells(lower, scale, T_op, A)
        limit = np.inf if wanted[k] else 0.0
        at, best = last[k], distance_at(values, lower, scale, T_op, points[last[k]])
        if inside and worth_a_look(floors, travel[k] + min(best, limit)) > FEW:
            boxes = tile_boxes[:, first:behind]
            raise_floors(flat, values.shape, bends, A, boxes, travel[k] - rounding, floors)
        tile = first + floors.argmin()
        for _ in range(first, behind):  # the likeliest tile, then those behind it
            bound = min(best, limit)
            if floor[tile] - travel[k] <= bound:
                begin = tile * TILE
                lowest = look(flat, values.shape, cell, A, tiles, begin, inside, near)
                floor[tile] = lowest - rounding + travel[k]
                if lowest - rounding <= bound:
                    at, best = closest_in_tile(
                        near,
                        rounding + min(bound, lowest + rounding),
                        at,
                        best,
                        order[begin:],
                        values,
                        lower,
                        scale,
                        T_op,
                        points,
                    )
            tile = tile + 1 if tile + 1 < behind else first
        last[k] = at
        if wanted[k] or best < 0:
            distances[k], indices[k] = best, at
            jacobians[k] = jacobian_at(values, lower, scale, T_op, points[at])
    return distances, jacobians, indices


@inlined_fast
def worth_a_look(floors: Any, bound: float) -> int:
    """How many floors are not above the bound."""
    count = 0
    for n in range(len(floors)):
        count += floors[n] <= bound
    return count


@inlined
def closest_in_tile(
    near: Any,
    bound: float,
    at: int,
    best: float,
    order: Any,
    values: Any,
    lower: Any,
    scale: Any,
    T_op: Any,
    points: Any,
) -> Any:
    """The closest point so far and its distance, (at, best), after a tile's points that look as near as ``bound``."""
    for n in range(TILE):
        if near[n] <= bound:
            phi = distance_at(values, lower, scale, T_op, points[order[n]])
            if phi < best or (phi == best and order[n] < at):
                at, best = order[n], phi
    return at, best


@inlined
def distance_at(values: Any, lower: Any, scale: Any, T: Any, p: Any) -> float:
    """Distance of the point T p."""
    x, y, z = transform(T, p)
    return trilinear(values, lower, scale, x, y, z)[0]  # type: ignore[no-any-return]


@inlined
def jacobian_at(values: Any, lower: Any, scale: Any, T: Any, p: Any) -> Any:
    """dphi/dxi = grad phi^T [skew(p_o) -I] = [(grad phi x p_o)^T  -grad phi^T], six numbers."""
    x, y, z = transform(T, p)
    _, gx, gy, gz = trilinear(values, lower, scale, x, y, z)
    return gy * z - gz * y, gz * x - gx * z, gx * y - gy * x, -gx, -gy, -gz


@inlined
def relative_pose(T_wo: Any, T_wp: Any, T_op: Any) -> None:
    """T_wo^-1 T_wp into ``T_op`` (3, 4)."""
    d0, d1, d2 = T_wp[0, 3] - T_wo[0, 3], T_wp[1, 3] - T_wo[1, 3], T_wp[2, 3] - T_wo[2, 3]
    for i in range(3):
        for j in range(3):
            T_op[i, j] = T_wo[0, i] * T_wp[0, j] + T_wo[1, i] * T_wp[1, j] + T_wo[2, i] * T_wp[2, j]
        T_op[i, 3] = T_wo[0, i] * d0 + T_wo[1, i] * d1 + T_wo[2, i] * d2


@inlined
def transform(T: Any, p: Any) -> Any:
    """Coordinates of T p, given the upper rows of T."""
    x = T[0, 0] * p[0] + T[0, 1] * p[1] + T[0, 2] * p[2] + T[0, 3]
    y = T[1, 0] * p[0] + T[1, 1] * p[1] + T[1, 2] * p[2] + T[1, 3]
    z = T[2, 0] * p[0] + T[2, 1] * p[1] + T[2, 2] * p[2] + T[2, 3]
    return x, y, z


@compiled
def points_in_world(T_wp: Any, points_p: Any, indices: Any) -> Any:
    """Point ``indices[k]`` of pad k in the world (K, 3); NaN where the index is -1."""
    points_w = np.full((len(indices), 3), np.nan)
    for k in range(len(indices)):
        if indices[k] >= 0:
            x, y, z = transform(T_wp[k], points_p[indices[k]])
            points_w[k, 0], points_w[k, 1], points_w[k, 2] = x, y, z
    return points_w


@inlined
def bounds_of_pad(
    shape: Any,
    lower: Any,
    scale: Any,
    lipschitz: Any,
    largest: float,
    T_op: Any,
    seen: Any,
    seen_inside: bool,
    box: Any,
) -> Any:
    """What holds for all points in a box around the pad's: (inside, rounding, moved).

    inside: The box is in the grid, by 0.01 cells, which is more than single precision can be wrong.

    rounding: Most that a single-precision distance is wrong [m]. A cell coordinate comes from 4 products and sums
    and as many rounded inputs, each wrong by 2^-24 of at most the pad's reach from the grid's first node; three
    axes together move phi by less than 28 L 2^-24 reach. Seven linear interpolations of three operations add less
    than 48 x 2^-24 of the largest value, the distance beyond the grid less than 8 x 2^-24 reach. ``ROUNDING`` is
    twice the 64 x 2^-24 that covers these.

    moved: Most that a point's distance differs from that at the pose seen last [m], 0 where none was: L times the
    way of the box's centre, and of each axis' end.
    """
    centre, half = box[0], box[1]
    inside, reach, size = True, 0.0, 0.0
    way, way_x, way_y, way_z = 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        middle = T_op[i, 0] * centre[0] + T_op[i, 1] * centre[1] + T_op[i, 2] * centre[2]
        middle += T_op[i, 3]
        extent = abs(T_op[i, 0]) * half[0] + abs(T_op[i, 1]) * half[1] + abs(T_op[i, 2]) * half[2]
        inside &= 0.01 < (middle - extent - lower[i]) * scale[i]
        inside &= (middle + extent - lower[i]) * scale[i] < shape[i] - 1.01
        reach = max(reach, abs(middle - lower[i]) + extent)
        size += abs(centre[i]) + half[i]
        was = seen[i, 0] * centre[0] + seen[i, 1] * centre[1] + seen[i, 2] * centre[2] + seen[i, 3]
        way += (middle - was) ** 2
        way_x += (T_op[i, 0] - seen[i, 0]) ** 2
        way_y += (T_op[i, 1] - seen[i, 1]) ** 2
        way_z += (T_op[i, 2] - seen[i, 2]) ** 2
    rounding = ROUNDING * lipschitz[1] * (largest + reach + size)
    if not np.isfinite(seen[0, 3]):
        return inside, rounding, 0.0
    moved = np.sqrt(way) + half[0] * np.sqrt(way_x) + half[1] * np.sqrt(way_y)
    moved += half[2] * np.sqrt(way_z)
    slope = lipschitz[0] if inside and seen_inside else lipschitz[1]
    return inside, rounding, slope * moved


@inlined
def to_cells(lower: Any, scale: Any, T_op: Any, A: Any) -> None:
    """The map from the pad's frame to cells of the grid, in single precision, into ``A`` (3, 4)."""
    for i in range(3):
        for j in range(3):
            A[i, j] = T_op[i, j] * scale[i]
        A[i, 3] = (T_op[i, 3] - lower[i]) * scale[i]
