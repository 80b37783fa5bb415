# SPDX-License-Identifier: MIT
"""Arrays handed to compiled code by address.

To unbox one array argument costs Numba 0.1 microseconds. The search has fifteen, and is asked a dozen times a frame:
looked up by address they cost nothing, and all of them are one argument. An array handed over so must stay where it
is: whoever holds the table must hold the arrays as well, which ``Handles`` does.
"""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numba.core import cgutils
from numba.extending import intrinsic

from .compiled import compiled

_FIELDS = 5  # of the table for each array: its address and up to four dimensions
_held: dict[int, np.ndarray] = {}  # by address; only where nothing is compiled


class Handles:
    """Arrays and a table of where they lie.

    Attributes:
        arrays: The arrays, contiguous in C order.
        table: For each the address and up to four dimensions, shape (N * 5,), int64; for ``array1`` and its like.
    """

    def __init__(self, *arrays: np.ndarray) -> None:
        self.arrays = arrays
        self.table = np.zeros(_FIELDS * len(arrays), dtype=np.int64)
        for n, array in enumerate(arrays):
            if not array.flags.c_contiguous:
                raise ValueError(f"array {n} must be contiguous in C order, it is not")
            self.table[_FIELDS * n] = array.ctypes.data
            self.table[_FIELDS * n + 1 : _FIELDS * n + 1 + array.ndim] = array.shape
            if numba.config.DISABLE_JIT:
                _held[array.ctypes.data] = array

    def __reduce__(self) -> Any:
        """A copy has addresses of its own, those of the copied arrays."""
        return Handles, self.arrays


@intrinsic  # type: ignore[untyped-decorator]
def _pointer(typing_context: Any, address: Any) -> Any:
    """An integer as a pointer."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        return builder.inttoptr(arguments[0], cgutils.voidptr_t)

    return numba.types.voidptr(numba.types.intp), generate


@compiled
def array1(table: Any, n: int, dtype: Any) -> Any:
    """The n-th array of a table, of one dimension."""
    return numba.carray(_pointer(table[_FIELDS * n]), (table[_FIELDS * n + 1],), dtype)


@compiled
def array2(table: Any, n: int, dtype: Any) -> Any:
    """The n-th array of a table, of two dimensions."""
    at = _FIELDS * n
    return numba.carray(_pointer(table[at]), (table[at + 1], table[at + 2]), dtype)


@compiled
def array3(table: Any, n: int, dtype: Any) -> Any:
    """The n-th array of a table, of three dimensions."""
    at = _FIELDS * n
    return numba.carray(_pointer(table[at]), (table[at + 1], table[at + 2], table[at + 3]), dtype)


@compiled
def array4(table: Any, n: int, dtype: Any) -> Any:
    """The n-th array of a table, of four dimensions."""
    at = _FIELDS * n
    shape = (table[at + 1], table[at + 2], table[at + 3], table[at + 4])
    return numba.carray(_pointer(table[at]), shape, dtype)


def _held_array(table: np.ndarray, n: int, dtype: Any) -> np.ndarray:
    """The n-th array of a table, where the code above is not compiled."""
    return _held[int(table[_FIELDS * n])]


if numba.config.DISABLE_JIT:
    array1 = array2 = array3 = array4 = _held_array
