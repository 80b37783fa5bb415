# SPDX-License-Identifier: MIT
r"""How far a trilinear field can be from linear, place by place: bounds of its second differences.

Along a step of d_x, d_y, d_z cells from a point c, the derivative of the field along x changes

- by at most |d_y| H_xy + |d_z| H_xz per cell of x, since within cells it is linear in y and in z;
- by at most H_xx at each crossing from a cell to the next along x, of which there are at most |d_x| + 1,

H_xy and H_xx being the largest mixed and second differences of the nodes in reach [m]. Integrated along the step,

    |phi(c + d) - phi(c) - grad phi(c)^T d| <= sum_a |d_a| H_aa + 1/2 sum_ab |d_a| |d_b| H_ab.

On a smooth surface this is a small share of what a Lipschitz constant allows, |grad phi(c)^T d| most of all where
a pad lies along the surface.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiled import compiled

SHIFT = 2
BLOCK = 1 << SHIFT  # cells a side for which one set of bounds is kept
_ROUNDING = 2.0**-20  # of single-precision differences, per metre of the largest node


@compiled
def bends_in_blocks(values: Any, reach: int, largest: float) -> Any:
    """Largest absolute second differences xx, yy, zz, xy, xz, yz [m] around each block of cells.

    Args:
        values: Distances at the nodes (nx, ny, nz).
        reach: How many cells beyond a block count as around it.
        largest: Largest absolute value of a node.

    Returns:
        Shape (ceil((nx - 1) / BLOCK), ..., ..., 6), float32.
    """
    nx, ny, nz = values.shape
    bx, by, bz = (nx + BLOCK - 2) // BLOCK, (ny + BLOCK - 2) // BLOCK, (nz + BLOCK - 2) // BLOCK
    row = np.zeros((6, nz), np.float32)
    plane = np.zeros((ny, bz, 6), np.float32)
    slab = np.zeros((nx, by, bz, 6), np.float32)
    for i in range(nx):
        for j in range(ny):
            _second_differences(values, i, j, row)
            _most_along_row(row, reach, plane[j])
        _most_along_first(plane, reach, slab[i])
    bends = np.zeros((bx, by, bz, 6), np.float32)
    _most_along_first(slab, reach, bends)
    return bends + np.float32(_ROUNDING * largest)


@compiled
def _second_differences(values: Any, i: int, j: int, row: Any) -> None:
    """Of the nodes (i, j, :) into ``row`` (6, nz); mixed ones with the node behind along both axes."""
    nx, ny, nz = values.shape
    a, b = max(i - 1, 0), min(i + 1, nx - 1)
    c, d = max(j - 1, 0), min(j + 1, ny - 1)
    inside_x, inside_y = b - a == 2, d - c == 2
    for k in range(nz):
        e, f = max(k - 1, 0), min(k + 1, nz - 1)
        here = values[i, j, k]
        row[0, k] = abs(values[a, j, k] - 2 * here + values[b, j, k]) if inside_x else 0
        row[1, k] = abs(values[i, c, k] - 2 * here + values[i, d, k]) if inside_y else 0
        row[2, k] = abs(values[i, j, e] - 2 * here + values[i, j, f]) if f - e == 2 else 0
        row[3, k] = abs(values[b, d, k] - values[b, j, k] - values[i, d, k] + here)
        row[4, k] = abs(values[b, j, f] - values[b, j, k] - values[i, j, f] + here)
        row[5, k] = abs(values[i, d, f] - values[i, d, k] - values[i, j, f] + here)


@compiled
def _most_along_row(row: Any, reach: int, most: Any) -> None:
    """Largest of each row (6, nz) around each block, into ``most`` (blocks, 6)."""
    for block in range(len(most)):
        first, last = block * BLOCK - reach, (block + 1) * BLOCK + reach
        for c in range(6):
            found = np.float32(0)
            for k in range(max(first, 0), min(last + 1, row.shape[1])):
                found = max(found, row[c, k])
            most[block, c] = found


@compiled
def _most_along_first(rows: Any, reach: int, most: Any) -> None:
    """Largest of rows (n, ...) around each block along the first axis, into ``most`` (blocks, ...)."""
    for block in range(len(most)):
        first, last = block * BLOCK - reach, (block + 1) * BLOCK + reach
        target = most[block].ravel()
        target[:] = 0
        for n in range(max(first, 0), min(last + 1, len(rows))):
            source = rows[n].ravel()
            for m in range(len(target)):
                target[m] = max(target[m], source[m])
