# SPDX-License-Identifier: MIT
import numba
import numpy as np
import pytest

from vtgtsam.handles import Handles, array1, array2, array3, array4

ARRAYS = (
    np.arange(5.0),
    np.arange(6, dtype=np.float32).reshape(2, 3),
    np.arange(24, dtype=np.int64).reshape(2, 3, 4),
    np.arange(120, dtype=np.float32).reshape(2, 3, 4, 5),
    np.array([True, False, True]),
)


@numba.njit
def sums(table):
    return (
        array1(table, 0, np.float64).sum(),
        array2(table, 1, np.float32)[1, 2],
        array3(table, 2, np.int64)[1, 2, 3],
        array4(table, 3, np.float32)[1, 2, 3, 4],
        array1(table, 4, np.bool_).sum(),
    )


@numba.njit
def write(table):
    array2(table, 0, np.float64)[1, 2] = 7.0


def test_compiled_code_finds_the_arrays_by_address():
    assert sums(Handles(*ARRAYS).table) == (10.0, 5.0, 23, 119.0, 2)


def test_what_compiled_code_writes_is_in_the_array():
    array = np.zeros((2, 3))
    write(Handles(array).table)
    assert array[1, 2] == 7.0 and array.sum() == 7.0


def test_the_arrays_live_as_long_as_the_handles():
    handles = Handles(np.full(1000, 1.0))
    other = [np.full(1000, 2.0) for _ in range(100)]
    assert array_sum(handles.table) == 1000.0 and len(other) == 100


@numba.njit
def array_sum(table):
    return array1(table, 0, np.float64).sum()


def test_an_array_that_is_not_contiguous_is_refused():
    with pytest.raises(ValueError, match="array 1 must be contiguous in C order"):
        Handles(np.zeros(3), np.zeros((3, 4)).T)
