# SPDX-License-Identifier: MIT
"""The compiled search: for each pad, which tiles may hold its closest point, and which point it is."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled_in_place, inlined
from ..kernels import trilinear
from .field import Field
from .pad_pose import cells_from_pad, motion, placement, relative_pose, slope_anywhere, transform
from .single_precision import least, tile_bounds, tile_distances
from .tiles import TILE, Tiles

FEW = 5  # tiles looked at without bounding all of them anew
FORGET = 1.0  # [m], a pad whose distances may have changed by more starts with no bounds


class Memory(NamedTuple):
    """What is known of each pad from the poses before.

    Attributes:
        bounds: Lower bounds of its tiles' distances [m], shape (K, most tiles of a pad): what they say at the pose
            before is ``bounds`` less ``moved``.
        moved: Most that its distances changed since the bounds were found [m], shape (K,).
        T_before: Its pose in the object's frame at the pose before, upper rows, shape (K, 3, 4).
        inside_before: Whether it was inside the grid there, shape (K,).
        closest: The tile that held its closest point last, counted from its first, shape (K,).
    """

    bounds: NDArray[np.float64]
    moved: NDArray[np.float64]
    T_before: NDArray[np.float64]
    inside_before: NDArray[np.bool_]
    closest: NDArray[np.int64]

    @classmethod
    def empty(cls, tiles: Tiles) -> Memory:
        """Nothing is known: no distance is below minus infinity."""
        pads, most = len(tiles.counts), int(tiles.counts.max())
        return cls(
            bounds=np.full((pads, most), -np.inf),
            moved=np.zeros(pads),
            T_before=np.zeros((pads, 3, 4)),
            inside_before=np.zeros(pads, dtype=bool),
            closest=np.zeros(pads, dtype=np.int64),
        )


class Room(NamedTuple):
    """Room for what is found of one pad at one pose.

    Attributes:
        T_op: The pad's pose in the object's frame, upper rows, shape (3, 4).
        A: The map from the pad's frame to cells of the grid, shape (3, 4).
        near: Distances of its tiles' points in single precision [m], shape (most tiles of a pad, TILE).
        anew: Lower bounds of its tiles' distances in single precision [m], shape (most tiles of a pad,).
        candidates: Tiles that may hold the closest point, shape (most tiles of a pad + 1,).
    """

    T_op: NDArray[np.float64]
    A: NDArray[np.float32]
    near: NDArray[np.float32]
    anew: NDArray[np.float32]
    candidates: NDArray[np.int64]

    @classmethod
    def enough_for(cls, tiles: Tiles) -> Room:
        """Room for the pad with the most tiles."""
        most = int(tiles.counts.max())
        return cls(
            T_op=np.empty((3, 4)),
            A=np.empty((3, 4), np.float32),
            near=np.empty((most, TILE), np.float32),
            anew=np.empty(most, np.float32),
            candidates=np.empty(most + 1, np.int64),
        )


@compiled_in_place
def closest_on_pads(
    T_wo: NDArray[np.float64],
    T_wp: NDArray[np.float64],
    needed: NDArray[np.bool_],
    distances: NDArray[np.float64],
    jacobians: NDArray[np.float64],
    indices: NDArray[np.int64],
    values: NDArray[np.float32],
    planes: NDArray[np.float32],
    lower: NDArray[np.float64],
    scale: NDArray[np.float64],
    shift: int,
    slope: float,
    largest: float,
    first: NDArray[np.int64],
    counts: NDArray[np.int64],
    offsets: NDArray[np.int64],
    points: NDArray[np.float64],
    order: NDArray[np.int64],
    coordinates: NDArray[np.float32],
    boxes: NDArray[np.float32],
    pad_boxes: NDArray[np.float64],
    bounds: NDArray[np.float64],
    moved: NDArray[np.float64],
    T_before: NDArray[np.float64],
    inside_before: NDArray[np.bool_],
    closest: NDArray[np.int64],
    T_op: NDArray[np.float64],
    A: NDArray[np.float32],
    near: NDArray[np.float32],
    anew: NDArray[np.float32],
    candidates: NDArray[np.int64],
) -> None:
    """Each pad's closest point at one object pose, into ``distances``, ``jacobians`` and ``indices``.

    The arguments are T_wo (4, 4), T_wp (K, 4, 4), ``needed`` (K,), the arrays of a ``PadContacts``, and one by one the
    fields of a ``Field``, ``Tiles``, ``Memory`` and ``Room``: whole, these would take 3 microseconds more to hand over.
    """
    field = Field(values, planes, lower, scale, shift, slope, largest)
    tiles = Tiles(first, counts, offsets, points, order, coordinates, boxes, pad_boxes)
    memory = Memory(bounds, moved, T_before, inside_before, closest)
    room = Room(T_op, A, near, anew, candidates)
    for k in range(len(T_wp)):
        relative_pose(T_wo, T_wp[k], T_op)
        inside, far, rounding = placement(field, T_op, pad_boxes[k])
        move_bounds(field, tiles, memory, T_op, k, inside)
        best, index, jacobian = np.inf, -1, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
        limit = np.inf if needed[k] else 0.0  # what is not below it does not matter
        if needed[k] or not least(bounds[k, : counts[k]]) > moved[k]:
            if far:
                count, upper = all_tiles(tiles, room, k), limit
            else:
                cells_from_pad(field, T_op, A)
                count, upper = likely_tiles(field, tiles, memory, room, k, inside, rounding, limit)
            best, index, jacobian = closest_of(
                field, tiles, memory, room, k, count, rounding, upper, limit
            )
        distances[k], indices[k] = best, index
        for i in range(6):
            jacobians[k, i] = jacobian[i]


@inlined
def move_bounds(
    field: Field,
    tiles: Tiles,
    memory: Memory,
    T_op: NDArray[np.float64],
    k: int,
    inside: bool,
) -> None:
    """Let pad k's lower bounds hold at its pose ``T_op``: no distance falls by more than the slope times the motion."""
    slope = field.slope if inside and memory.inside_before[k] else slope_anywhere(field)
    moved = memory.moved[k] + slope * motion(memory.T_before[k], T_op, tiles.pad_boxes[k])
    if not moved < FORGET:  # NaN neither
        for tile in range(tiles.counts[k]):
            memory.bounds[k, tile] = -np.inf
        moved = 0.0
    memory.moved[k], memory.inside_before[k] = moved, inside
    for i in range(3):
        for j in range(4):
            memory.T_before[k, i, j] = T_op[i, j]


@inlined
def likely_tiles(
    field: Field,
    tiles: Tiles,
    memory: Memory,
    room: Room,
    k: int,
    inside: bool,
    rounding: float,
    limit: float,
) -> tuple[int, float]:
    """Pad k's tiles that may hold its closest point: how many ``room.candidates``, and its distance's upper bound [m].

    The tile that held it last is looked at first: that gives an upper bound, which few lower bounds are not above. Then
    these, the least lower bound first, until it is above what has been found.
    """
    found, bounds = room.candidates, memory.bounds[k]
    found[0], count, looked, upper = memory.closest[k], 1, 0, limit
    while looked < count:
        bring_least_forward(found, bounds, looked, count)
        tile = found[looked]
        if looked > 0 and bounds[tile] - memory.moved[k] > upper:
            break
        begin = (tiles.first[k] + tile) * TILE
        points, near = tiles.coordinates, room.near[tile]
        lowest = float(tile_distances(field, room.A, inside, points, begin, near))
        bounds[tile] = lowest - rounding + memory.moved[k]
        upper = lowest + rounding if lowest + rounding < upper else upper
        looked += 1
        if looked == 1:
            count = add_others(tiles, memory, found, k, upper)
            if count > FEW:
                bound_anew(field, tiles, memory, room, k, inside, rounding)
                count = add_others(tiles, memory, found, k, upper)
    return looked, upper


@inlined
def add_others(tiles: Tiles, memory: Memory, found: NDArray[np.int64], k: int, upper: float) -> int:
    """Put pad k's tiles whose lower bounds are not above ``upper`` behind ``found[0]``; how many there are then."""
    highest, count = upper + memory.moved[k], 1
    for tile in range(tiles.counts[k]):
        found[count] = tile
        count += (memory.bounds[k, tile] <= highest) & (tile != found[0])
    return count


@inlined
def bring_least_forward(
    found: NDArray[np.int64], bounds: NDArray[np.float64], begin: int, end: int
) -> None:
    """Put the tile of the least lower bound at ``begin`` of those from there to ``end``."""
    for n in range(begin + 1, end):
        if bounds[found[n]] < bounds[found[begin]]:
            found[n], found[begin] = found[begin], found[n]


@inlined
def bound_anew(
    field: Field,
    tiles: Tiles,
    memory: Memory,
    room: Room,
    k: int,
    inside: bool,
    rounding: float,
) -> None:
    """Raise pad k's lower bounds to what the field's linear lower bounds say at this pose."""
    count, bounds = tiles.counts[k], memory.bounds[k]
    tile_bounds(field, room.A, inside, tiles.boxes, tiles.first[k], room.anew[:count])
    for tile in range(count):
        moved, anew = bounds[tile] - memory.moved[k], room.anew[tile] - rounding
        bounds[tile] = moved if moved > anew else anew
    memory.moved[k] = 0.0


@inlined
def all_tiles(tiles: Tiles, room: Room, k: int) -> int:
    """Make all of pad k's tiles candidates, and none of their points too far; how many tiles there are."""
    count: int = tiles.counts[k]
    for tile in range(count):
        room.candidates[tile] = tile
        for m in range(TILE):
            room.near[tile, m] = -np.inf
    return count


@inlined
def closest_of(
    field: Field,
    tiles: Tiles,
    memory: Memory,
    room: Room,
    k: int,
    count: int,
    rounding: float,
    upper: float,
    limit: float,
) -> tuple[float, int, tuple[float, float, float, float, float, float]]:
    """The distance [m], index and derivative of pad k's closest point below ``limit``; (inf, -1, zeros) without one.

    In double precision, at those points of ``count`` candidates that may be as close as ``upper``. Of equal ones the
    first counts. The derivative is dphi/dxi = grad phi^T [skew(p_o) -I] = [(grad phi x p_o)^T  -grad phi^T].
    """
    best, index, jacobian = limit, -1, (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    for n in range(count):
        tile = room.candidates[n]
        if memory.bounds[k, tile] - memory.moved[k] > upper:
            continue
        for m in range(TILE):
            if room.near[tile, m] - rounding > upper:
                continue
            point = (tiles.first[k] + tile) * TILE + m
            p, at = tiles.points[point], tiles.offsets[k] + tiles.order[point]
            x, y, z = transform(room.T_op, p[0], p[1], p[2])
            phi, gx, gy, gz = trilinear(field.values, field.lower, field.scale, x, y, z)
            if phi < best or (phi == best and at < index):
                best, index, memory.closest[k] = phi, at, tile
                jacobian = (gy * z - gz * y, gz * x - gx * z, gx * y - gy * x, -gx, -gy, -gz)
    return (best if index >= 0 else np.inf), index, jacobian
