# SPDX-License-Identifier: MIT
"""Where a pad is in the object's frame, and what follows for all of its points."""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiled import compiled, inlined

# Bound of a single-precision distance's error, per metre of distance and of reach.
ROUNDING = 2.0**-17
FAR = 8192  # cells; what is farther away is evaluated in double precision only
LOWER, SCALE, INSIDE, ANYWHERE, LARGEST, SHIFT = 0, 3, 6, 7, 8, 9  # places in a search's ``field``


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
def bounds_of_pad(shape: Any, field: Any, T_op: Any, seen: Any, seen_inside: bool, box: Any) -> Any:
    """What holds for all points in a box around the pad's: (inside, far, rounding, moved).

    inside: The box is in the grid, by 0.01 cells, which is more than single precision can be wrong where it is not far.

    far: Cell coordinates, or what they are sums of, may be above ``FAR``: no use for single precision.

    rounding: Most that a single-precision distance is wrong [m]. A cell coordinate comes from 4 products and sums
    and as many rounded inputs, each wrong by 2^-24 of at most the pad's reach from the grid's first node; three
    axes together move phi by less than 28 L 2^-24 reach. Seven linear interpolations of three operations add less
    than 48 x 2^-24 of the largest value, the distance beyond the grid less than 8 x 2^-24 reach; a minorant is a sum
    of fewer such terms. ``ROUNDING`` is twice the 64 x 2^-24 that covers these.

    moved: Most that a point's distance differs from that at the pose seen last [m], 0 where none was: L times the
    way of the box's centre, and of each axis' end.
    """
    centre, half = box[0], box[1]
    inside, reach, size = True, 0.0, 0.0
    way, way_x, way_y, way_z = 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        lower, scale = field[LOWER + i], field[SCALE + i]
        middle = T_op[i, 0] * centre[0] + T_op[i, 1] * centre[1] + T_op[i, 2] * centre[2]
        middle += T_op[i, 3]
        extent = abs(T_op[i, 0]) * half[0] + abs(T_op[i, 1]) * half[1] + abs(T_op[i, 2]) * half[2]
        inside &= 0.01 < (middle - extent - lower) * scale
        inside &= (middle + extent - lower) * scale < shape[i] - 1.01
        reach = max(reach, abs(middle - lower) + extent)
        size += abs(centre[i]) + half[i]
        was = seen[i, 0] * centre[0] + seen[i, 1] * centre[1]
        was += seen[i, 2] * centre[2] + seen[i, 3]
        way += (middle - was) ** 2
        way_x += (T_op[i, 0] - seen[i, 0]) ** 2
        way_y += (T_op[i, 1] - seen[i, 1]) ** 2
        way_z += (T_op[i, 2] - seen[i, 2]) ** 2
    finest = max(field[SCALE], max(field[SCALE + 1], field[SCALE + 2]))
    far = not (reach + size) * finest < FAR
    rounding = ROUNDING * field[ANYWHERE] * (field[LARGEST] + reach + size)
    if not np.isfinite(seen[0, 3]):
        return inside, far, rounding, 0.0
    moved = np.sqrt(way) + half[0] * np.sqrt(way_x) + half[1] * np.sqrt(way_y)
    moved += half[2] * np.sqrt(way_z)
    slope = field[INSIDE] if inside and seen_inside else field[ANYWHERE]
    return inside, far, rounding, slope * moved


@inlined
def to_cells(lower: Any, scale: Any, T_op: Any, A: Any) -> None:
    """The map from the pad's frame to cells of the grid, in single precision, into ``A`` (3, 4)."""
    for i in range(3):
        for j in range(3):
            A[i, j] = T_op[i, j] * scale[i]
        A[i, 3] = (T_op[i, 3] - lower[i]) * scale[i]
