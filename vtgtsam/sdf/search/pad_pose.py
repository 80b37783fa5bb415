# SPDX-License-Identifier: MIT
"""Where a pad is in the object's frame, and what that says of all its points at once."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled_in_place, inlined
from .field import Field

# Bound of a single-precision distance's error, per metre of distance and of reach.
ROUNDING = 2.0**-17
FAR = 8192  # cells; what is farther away is evaluated in double precision only


@inlined
def relative_pose(
    T_wo: NDArray[np.float64], T_wp: NDArray[np.float64], T_op: NDArray[np.float64]
) -> None:
    """T_wo^-1 T_wp into ``T_op`` (3, 4)."""
    d0, d1, d2 = T_wp[0, 3] - T_wo[0, 3], T_wp[1, 3] - T_wo[1, 3], T_wp[2, 3] - T_wo[2, 3]
    for i in range(3):
        for j in range(3):
            T_op[i, j] = T_wo[0, i] * T_wp[0, j] + T_wo[1, i] * T_wp[1, j] + T_wo[2, i] * T_wp[2, j]
        T_op[i, 3] = T_wo[0, i] * d0 + T_wo[1, i] * d1 + T_wo[2, i] * d2


@inlined
def transform(T: NDArray[np.float64], x: float, y: float, z: float) -> tuple[float, float, float]:
    """Coordinates of T p for p = (x, y, z), given the upper rows of T."""
    return (
        T[0, 0] * x + T[0, 1] * y + T[0, 2] * z + T[0, 3],
        T[1, 0] * x + T[1, 1] * y + T[1, 2] * z + T[1, 3],
        T[2, 0] * x + T[2, 1] * y + T[2, 2] * z + T[2, 3],
    )


@inlined
def cells_from_pad(field: Field, T_op: NDArray[np.float64], A: NDArray[np.float32]) -> None:
    """The map from the pad's frame to cells of the grid, in single precision, into ``A`` (3, 4)."""
    for i in range(3):
        for j in range(3):
            A[i, j] = T_op[i, j] * field.scale[i]
        A[i, 3] = (T_op[i, 3] - field.lower[i]) * field.scale[i]


@inlined
def slope_anywhere(field: Field) -> float:
    """Most that the distance changes per metre, inside the grid or outside."""
    return math.sqrt(field.slope * field.slope + 1.0)


@inlined
def placement(
    field: Field, T_op: NDArray[np.float64], box: NDArray[np.float64]
) -> tuple[bool, bool, float]:
    """What holds for all points in a pad's box (centre and half extents, (2, 3)): (inside, far, rounding).

    inside: The box is in the grid, by 0.01 cells, which is more than single precision can be wrong where it is not far.

    far: Cell coordinates, or what they are sums of, may be above ``FAR``, or are not finite: no use for single
    precision.

    rounding: Most that a single-precision distance is wrong [m]. A cell coordinate comes from 4 products and sums
    and as many rounded inputs, each wrong by 2^-24 of at most the pad's reach from the grid's first node; three
    axes together move phi by less than 28 L 2^-24 reach. Seven linear interpolations of three operations add less
    than 48 x 2^-24 of the largest value, the distance beyond the grid less than 8 x 2^-24 reach; a linear lower bound
    is a sum of fewer such terms. ``ROUNDING`` is twice the 64 x 2^-24 that covers these.
    """
    inside, far, reach, size = True, False, 0.0, 0.0
    for i in range(3):
        size += abs(box[0, i]) + box[1, i]
    for i in range(3):
        lower, scale = field.lower[i], field.scale[i]
        middle = T_op[i, 3]
        extent = 0.0
        for j in range(3):
            middle += T_op[i, j] * box[0, j]
            extent += abs(T_op[i, j]) * box[1, j]
        inside &= 0.01 < (middle - extent - lower) * scale
        inside &= (middle + extent - lower) * scale < field.values.shape[i] - 1.01
        beyond = abs(middle - lower) + extent
        far |= not (beyond + size) * scale < FAR
        reach = beyond if beyond > reach else reach
    return inside, far, ROUNDING * slope_anywhere(field) * (field.largest + reach + size)


@inlined
def motion(
    T_before: NDArray[np.float64], T_op: NDArray[np.float64], box: NDArray[np.float64]
) -> float:
    """Most that a point in a pad's box moved between two poses [m]: the way of its centre and of each axis' end."""
    way, way_x, way_y, way_z = 0.0, 0.0, 0.0, 0.0
    for i in range(3):
        x, y, z = (
            T_op[i, 0] - T_before[i, 0],
            T_op[i, 1] - T_before[i, 1],
            T_op[i, 2] - T_before[i, 2],
        )
        centre = x * box[0, 0] + y * box[0, 1] + z * box[0, 2] + T_op[i, 3] - T_before[i, 3]
        way += centre * centre
        way_x += x * x
        way_y += y * y
        way_z += z * z
    turned: float = (
        box[1, 0] * math.sqrt(way_x) + box[1, 1] * math.sqrt(way_y) + box[1, 2] * math.sqrt(way_z)
    )
    return math.sqrt(way) + turned


@compiled_in_place
def place_points(
    T_wp: NDArray[np.float64],
    points_p: NDArray[np.float64],
    indices: NDArray[np.int64],
    points_w: NDArray[np.float64],
) -> None:
    """Point ``indices[k]`` of pad k in the world into ``points_w`` (K, 3) [m]; NaN where the index is -1."""
    for k in range(len(indices)):
        n = indices[k]
        if n >= len(points_p) or n < -1:
            raise ValueError("indices must be those of points on the pads, or -1 for none")
        for i in range(3):
            coordinate = np.nan
            if n >= 0:
                coordinate = T_wp[k, i, 3]
                for j in range(3):
                    coordinate += T_wp[k, i, j] * points_p[n, j]
            points_w[k, i] = coordinate
