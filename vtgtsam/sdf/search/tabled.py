# SPDX-License-Identifier: MIT
r"""The compiled search for each pad's closest point: exactly the plain search's answer, with less looking.

The plain search takes the distance of every grid point of every pad, in double precision, at every pose. Here

- each pad's points are cut into tiles of ``TILE`` neighbours, and each tile has a ``floor``, which its least distance
  is not below. A floor stays good for later poses: when the pad has moved, no point of it has come closer by more than
  L x (the most that a point of it moved), L being the field's Lipschitz constant. These add up in ``travel``, and
  floor - travel is not above the tile's least distance at any later pose. Steps shrink quickly as an optimiser
  converges, and so does the set of tiles worth a look;
- where too many are left, all floors are found anew from linear functions below the field (``minorants``): most
  tiles end there, even at a pose unlike any before;
- the tiles left are looked at in single precision, the lowest floor first, until no floor is below the best distance;
- only points within that rounding of the best are evaluated in double precision;
- a pad that reports no contact matters only where phi < 0: there the best so far is 0 from the start;
- a pad so far away that single precision says nothing is evaluated in double precision, point by point, and one that
  has jumped begins with no floors: a frame of nonsense leaves nothing behind.

Every bound includes the rounding of single precision, so no shortcut changes a result.

What the search reads and remembers it finds by address (see ``handles``): ``new_search`` lists it.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from ...compiled import compiled, copy_matrix, inlined
from ...handles import Handles, array1, array2, array3, array4
from ...hands.pads import PadSet
from ..grid import GridSdf
from ..kernels import trilinear
from ..look import bound_anywhere, bound_inside, least, look
from ..minorants import block_shift
from ..pad_pose import (
    LOWER,
    ROUNDING,
    SCALE,
    SHIFT,
    bounds_of_pad,
    relative_pose,
    to_cells,
    transform,
)
from ..tiles import FIRST_FLOOR, FIRST_INDEX, FIRST_POINT, FIRST_TILE, TILE, TILES, cut_into_tiles

FEW = 5  # tiles looked at without finding all floors anew
FORGET = 1.0  # [m], a pad whose distances may have changed by more starts with no floors
IF_INSIDE, ALWAYS, NOT = 0, 1, 2  # values of ``asked``: the first two are a contact bit's
# The arrays of ``new_search``, in order.
VALUES, PLANES, FIELD, PADS, POINTS, ORDER, COORDINATES, BOXES, PAD_BOXES = range(9)
FLOOR, TRAVEL, SEEN, SEEN_INSIDE, LAST, NEAR, LOW, FOUND = range(9, 17)


def new_search(pads: PadSet, sdf: GridSdf) -> Handles:
    """What a search for these pads' closest points to this field reads and remembers."""
    tiles = cut_into_tiles(pads, ROUNDING * float((sdf.upper - sdf.lower).max()))
    radius = float(np.linalg.norm(tiles.boxes[3:], axis=0).max())
    most, total = tiles.pads[:, TILES].max(), tiles.pads[-1, [FIRST_FLOOR, TILES]].sum()
    steepest = sdf.lipschitz, math.hypot(sdf.lipschitz, 1.0)
    reach = math.ceil(radius * float(sdf.scale.max()))
    shift = block_shift(sdf.values.shape, reach)
    return Handles(
        sdf.values,
        # Linear functions below the field, which hold over a tile whose centre is in a block.
        sdf.minorants(reach),
        # First node's position, cells per metre, Lipschitz constants inside the grid and anywhere, largest absolute
        # distance at a node, logarithm to base 2 of the blocks' side.
        np.array([*sdf.lower, *sdf.scale, *steepest, sdf.largest, shift]),
        *tiles,
        np.full(total, -np.inf),  # each tile's floor
        np.zeros(len(pads)),  # each pad's travel
        # Each pad's pose in the object's frame when it was seen last, and whether it was inside the grid there.
        np.full((len(pads), 3, 4), np.inf),
        np.zeros(len(pads), dtype=bool),
        # The tile that held the closest point last, counted from the pad's first.
        np.zeros(len(pads), dtype=np.int64),
        # Room for looks at the tiles of the pad with most, for their bounds and for their numbers.
        np.empty((most, TILE), np.float32),
        np.empty(most, np.float32),
        np.empty(most + 1, dtype=np.int64),
    )


@compiled
def closest_on_pads(
    T_wo: Any, T_wp: Any, asked: Any, distances: Any, jacobians: Any, indices: Any, search: Any
) -> None:
    """Grid point of least distance on each pad, at one object pose.

    Args:
        T_wo: Object pose, (4, 4).
        T_wp: Pad poses, (K, 4, 4).
        asked: For each pad ``ALWAYS``, ``IF_INSIDE`` for one whose distance matters only if negative, or ``NOT`` for
            one whose results are to stay as they are, (K,).
        distances: Receives the distances, infinite where a pad was left out, (K,).
        jacobians: Receives their derivatives for a right perturbation of T_wo, rotation first, (K, 6).
        indices: Receives which of ``PadSet.points_p`` the points are, -1 where a pad was left out, (K,).
        search: Table of the arrays that ``new_search`` made.
    """
    values = array3(search, VALUES, np.float32)
    planes = array4(search, PLANES, np.float32)
    field = array1(search, FIELD, np.float64)
    pads = array2(search, PADS, np.int64)
    points = array2(search, POINTS, np.float64)
    order = array1(search, ORDER, np.int64)
    coordinates = array2(search, COORDINATES, np.float32)
    boxes = array2(search, BOXES, np.float32)
    pad_boxes = array3(search, PAD_BOXES, np.float64)
    floor, travels = array1(search, FLOOR, np.float64), array1(search, TRAVEL, np.float64)
    seen, seen_inside = array3(search, SEEN, np.float64), array1(search, SEEN_INSIDE, np.bool_)
    last = array1(search, LAST, np.int64)
    near = array2(search, NEAR, np.float32)
    low, found = array1(search, LOW, np.float32), array1(search, FOUND, np.int64)

    flat, shape, flat_planes = values.ravel(), values.shape, planes.ravel()
    lower, scale, shift = field[LOWER : LOWER + 3], field[SCALE : SCALE + 3], int(field[SHIFT])
    cell = (1.0 / scale).astype(np.float32)
    T, A = np.empty((3, 4)), np.empty((3, 4), np.float32)
    for k in range(len(T_wp)):
        if asked[k] == NOT:
            continue
        distances[k], indices[k] = np.inf, -1
        jacobians[k] = 0.0
        relative_pose(T_wo, T_wp[k], T)
        inside, far, rounding, moved = bounds_of_pad(
            shape, field, T, seen[k], seen_inside[k], pad_boxes[k]
        )
        travel = travels[k] + moved
        seen_inside[k] = inside
        copy_matrix(T, seen[k])
        limit = np.inf if asked[k] == ALWAYS else 0.0
        first, count = pads[k, FIRST_TILE], pads[k, TILES]
        floors = floor[pads[k, FIRST_FLOOR] : pads[k, FIRST_FLOOR] + count]
        if far or not travel < FORGET:
            floors[:] = -np.inf
            travel = 0.0
        travels[k] = travel
        if asked[k] != ALWAYS and least(floors) > travel:
            continue

        to_cells(lower, scale, T, A)
        # Tiles to look at are in ``found``, those looked at in front: first the one that was closest last, then the
        # lowest floor of those that are not above the bound.
        found[0], hits, looked, bound, begun = last[k], 1, 0, limit, False
        if far:
            near[:count] = -np.inf  # so that each point is evaluated
            hits = looked = not_above(floors, np.inf, found)
        while looked < hits:
            tile = found[looked]
            if begun and floors[tile] - travel > bound:
                break
            begin = (first + tile) * TILE
            lowest = look(flat, shape, cell, A, coordinates, begin, inside, near[tile])
            floors[tile] = lowest - rounding + travel
            bound = min(bound, lowest + rounding)
            looked += 1
            if not begun:
                begun, hits = True, not_above(floors, bound + travel, found)
                if hits > FEW:
                    if inside:
                        bound_inside(flat_planes, planes.shape, shift, A, boxes, first, count, low)
                    else:
                        bound_anywhere(
                            flat_planes,
                            planes.shape,
                            shift,
                            shape,
                            cell,
                            A,
                            boxes,
                            first,
                            count,
                            low,
                        )
                    for n in range(count):
                        floors[n] = max(floors[n] - travel, low[n] - rounding)
                    travels[k] = travel = 0.0
                    hits = not_above(floors, bound, found)
                looked = bring_forward(found, hits, tile)
            bring_lowest_forward(found, floors, looked, hits)

        last[k], at, best, J = closest_of_found(
            found[:looked],
            near,
            floors,
            travel,
            rounding,
            bound,
            last[k],
            order[first * TILE :],
            points[pads[k, FIRST_POINT] :],
            values,
            lower,
            scale,
            T,
        )
        if best < limit:
            distances[k], indices[k] = best, pads[k, FIRST_INDEX] + at
            for i in range(6):
                jacobians[k, i] = J[i]


@inlined
def closest_of_found(
    found: Any,
    near: Any,
    floors: Any,
    travel: float,
    rounding: float,
    bound: float,
    last: int,
    order: Any,
    points: Any,
    values: Any,
    lower: Any,
    scale: Any,
    T: Any,
) -> Any:
    """Evaluate what may be closest in double precision: its tile (or ``last``), point, distance and derivative.

    The derivative is dphi/dxi = grad phi^T [skew(p_o) -I] = [(grad phi x p_o)^T  -grad phi^T], six numbers.
    """
    best, at, held = np.inf, -1, last
    J = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for tile in found:
        if floors[tile] - travel > bound:
            continue
        for m in range(TILE):
            if near[tile, m] - rounding > bound:
                continue
            index = order[tile * TILE + m]
            x, y, z = transform(T, points[index])
            phi, gx, gy, gz = trilinear(values, lower, scale, x, y, z)
            if phi < best or (phi == best and index < at):
                best, at, held = phi, index, tile
                J = (gy * z - gz * y, gz * x - gx * z, gx * y - gy * x, -gx, -gy, -gz)
    return held, at, best, J


@inlined
def not_above(floors: Any, bound: float, found: Any) -> int:
    """How many floors are not above the bound; which ones, into ``found``."""
    hits = 0
    for n in range(len(floors)):
        found[hits] = n
        hits += floors[n] <= bound
    return hits


@inlined
def bring_forward(found: Any, hits: int, tile: int) -> int:
    """Put ``tile`` in front if it is among the hits; how many are in front then."""
    for n in range(hits):
        if found[n] == tile:
            found[n], found[0] = found[0], tile
            return 1
    return 0


@inlined
def bring_lowest_forward(found: Any, floors: Any, begin: int, end: int) -> None:
    """Put the tile with the lowest floor at ``begin`` of those from there to ``end``."""
    for n in range(begin + 1, end):
        if floors[found[n]] < floors[found[begin]]:
            found[n], found[begin] = found[begin], found[n]
