# SPDX-License-Identifier: MIT
r"""Linear lower bounds of a field, place by place.

For each block of cells, with u a place in cells from the first node,

    phi(u) >= m(u) = offset + g^T u        at every u within ``reach`` cells of the block.

g is the mean slope of the block's edges, the offset the largest that keeps m below the nodes in reach. That is enough
for all places between them: the weights of a trilinear interpolation are not negative and add up to 1, and what they
make of the values of a linear function is that function. On a convex surface m is all but the tangent plane, and what
a group of points can be nearer than its centre follows from three slopes, without a look at the field itself.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ...compiled import compiled, inlined, inlined_fast

BLOCKS = 64  # most blocks along an axis: 4 MB for a cube
_ROUNDING = np.float32(2.0**-20)  # of single precision, per metre of what is added up


def block_shift(shape: tuple[int, ...], reach: int) -> int:
    """Logarithm to base 2 of a block's side in cells.

    Two cells, or as many as ``BLOCKS`` asks; and half the reach at least, so that the work does not grow with it.
    """
    most = np.log2(max(shape))
    return int(np.ceil(min(most, max(1.0, most - np.log2(BLOCKS), np.log2(max(reach, 1) / 2)))))


@compiled
def linear_lower_bounds(
    values: NDArray[np.float32], shift: int, reach: int, largest: float
) -> NDArray[np.float32]:
    """Offset [m] and slopes [m per cell] of each block's m, shape (bx, by, bz, 4).

    Args:
        values: Distances at the nodes [m], shape (nx, ny, nz).
        shift: Logarithm to base 2 of a block's side in cells.
        reach: How many cells beyond a block m holds.
        largest: Largest absolute value of a node [m].
    """
    nx, ny, nz = values.shape
    side = 1 << shift
    bx, by, bz = ((nx - 2) >> shift) + 1, ((ny - 2) >> shift) + 1, ((nz - 2) >> shift) + 1
    found = np.empty((bx, by, bz, 4), np.float32)
    for i in range(bx):
        x0, x1 = i * side, min((i + 1) * side, nx - 1)
        for j in range(by):
            y0, y1 = j * side, min((j + 1) * side, ny - 1)
            for k in range(bz):
                z0, z1 = k * side, min((k + 1) * side, nz - 1)
                gx, gy, gz = _mean_slope(values, x0, x1, y0, y1, z0, z1)
                offset = np.float32(np.inf)
                first, last = max(z0 - reach, 0), min(z1 + reach, nz - 1)
                for a in range(max(x0 - reach, 0), min(x1 + reach, nx - 1) + 1):
                    for b in range(max(y0 - reach, 0), min(y1 + reach, ny - 1) + 1):
                        row = values[a, b, first : last + 1]
                        start = gx * np.float32(a) + gy * np.float32(b) + gz * np.float32(first)
                        offset = min(offset, _lowest_above(row, start, gz))
                summed = (
                    abs(gx) * np.float32(nx) + abs(gy) * np.float32(ny) + abs(gz) * np.float32(nz)
                )
                found[i, j, k, 0] = offset - _ROUNDING * (np.float32(largest) + summed)
                found[i, j, k, 1], found[i, j, k, 2], found[i, j, k, 3] = gx, gy, gz
    return found


@inlined
def _mean_slope(
    values: NDArray[np.float32], x0: int, x1: int, y0: int, y1: int, z0: int, z1: int
) -> tuple[np.float32, np.float32, np.float32]:
    """Mean slopes of a box's four edges along each axis [m per cell]."""
    v000, v001 = values[x0, y0, z0], values[x0, y0, z1]
    v010, v011 = values[x0, y1, z0], values[x0, y1, z1]
    v100, v101 = values[x1, y0, z0], values[x1, y0, z1]
    v110, v111 = values[x1, y1, z0], values[x1, y1, z1]
    gx = (v100 - v000) + (v101 - v001) + (v110 - v010) + (v111 - v011)
    gy = (v010 - v000) + (v011 - v001) + (v110 - v100) + (v111 - v101)
    gz = (v001 - v000) + (v011 - v010) + (v101 - v100) + (v111 - v110)
    four = np.float32(4)
    return (
        gx / (four * np.float32(x1 - x0)),
        gy / (four * np.float32(y1 - y0)),
        gz / (four * np.float32(z1 - z0)),
    )


@inlined_fast
def _lowest_above(row: NDArray[np.float32], start: np.float32, slope: np.float32) -> np.float32:
    """Least difference of a row to a line that begins at ``start``."""
    lowest = np.float32(np.inf)
    for n in range(len(row)):
        above = row[n] - (start + slope * np.float32(n))
        lowest = above if above < lowest else lowest
    return lowest
