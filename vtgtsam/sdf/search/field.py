# SPDX-License-Identifier: MIT
"""The distance field as the search reads it."""

from __future__ import annotations

import math
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from ..grid import GridSdf
from .linear_bounds import block_shift, linear_lower_bounds


class Field(NamedTuple):
    """The distance field, and what is known of it everywhere.

    Attributes:
        values: Distances at the nodes [m], shape (nx, ny, nz).
        planes: Linear lower bounds of blocks of cells, shape (bx, by, bz, 4) (see ``linear_bounds``).
        lower: Position of the first node [m], shape (3,).
        scale: Cells per metre along each axis, shape (3,).
        shift: Logarithm to base 2 of a block's side in cells.
        slope: Most that the distance changes per metre inside the grid.
        largest: Largest absolute distance at a node [m].
    """

    values: NDArray[np.float32]
    planes: NDArray[np.float32]
    lower: NDArray[np.float64]
    scale: NDArray[np.float64]
    shift: int
    slope: float
    largest: float


def read_field(sdf: GridSdf, radius: float) -> Field:
    """The field, with linear lower bounds that hold within ``radius`` [m] of a block."""
    reach = math.ceil(radius * float(sdf.scale.max()))
    return Field(
        values=sdf.values,
        planes=_bounds_within(sdf, reach),
        lower=sdf.lower,
        scale=sdf.scale,
        shift=block_shift(sdf.values.shape, reach),
        slope=sdf.lipschitz,
        largest=sdf.largest,
    )


_made: WeakKeyDictionary[GridSdf, dict[int, NDArray[np.float32]]] = WeakKeyDictionary()


def _bounds_within(sdf: GridSdf, reach: int) -> NDArray[np.float32]:
    """The field's linear lower bounds within ``reach`` cells, computed once for all searches."""
    made = _made.setdefault(sdf, {})
    if reach not in made:
        shift = block_shift(sdf.values.shape, reach)
        made[reach] = linear_lower_bounds(sdf.values, shift, reach, sdf.largest)
    return made[reach]
