# SPDX-License-Identifier: MIT
"""Decorators for loops compiled with Numba."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import numba
import numpy as np
from numba.extending import register_jitable
from numpy.typing import NDArray

from .stale import drop_stale

drop_stale(Path(__file__).parents[1])

logger = logging.getLogger(__name__)

P = ParamSpec("P")
R = TypeVar("R")


def compiled(function: Callable[P, R]) -> Callable[P, R]:
    """Compile with Numba to exact floating-point arithmetic.

    The machine code is kept on disk where the installation allows it. Numba raises already at import where it
    finds no folder to write to (a read-only install with no home directory): then each process compiles anew.
    """
    return _compile(function, nogil=True)


def compiled_in_place(function: Callable[P, R]) -> Callable[P, R]:
    """Compile like ``compiled`` what makes and returns no array, but fills those that it is given, in microseconds.

    Nothing counts references, and the interpreter lock is kept: the call takes an array in 30 ns, four times as fast,
    and no other thread finds the arrays half filled.
    """
    return _compile(function, _nrt=False)


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """Compile as a part of the compiled functions that call it, to exact arithmetic; Python calls it as Python.

    For small parts of a loop, which make no arrays: a call that passes arrays costs more than they do.
    """
    return _part(function)


def inlined_fast(function: Callable[P, R]) -> Callable[P, R]:
    """Compile like ``inlined``, but let the compiler reorder and fuse operations, so that it can vectorise.

    Only for loops whose rounding is bounded by whoever uses the result, and whose values are not NaN.
    """
    return _part(function, fastmath={"reassoc", "contract", "nsz", "arcp", "nnan"})


def on_disk(function: Callable[..., object]) -> bool:
    """Whether the machine code of a compiled function is kept from an earlier process."""
    stats = getattr(function, "stats", None)
    if stats is None:  # nothing is compiled: NUMBA_DISABLE_JIT
        return True
    if stats.cache_path is None:
        return False
    name = f"{function.__module__.rsplit('.', 1)[-1]}.{function.__qualname__}"
    return any(Path(stats.cache_path).glob(f"{name}-*.nbi"))


def _compile(function: Callable[P, R], **options: Any) -> Callable[P, R]:
    options |= {"error_model": "numpy", "no_cfunc_wrapper": True}
    try:
        return _kept_where_possible(numba.njit(cache=True, **options)(function))  # type: ignore[no-any-return]
    except RuntimeError as error:
        logger.debug("%s: compiled without a cache on disk (%s)", function.__name__, error)
        return numba.njit(**options)(function)  # type: ignore[no-any-return]


def _kept_where_possible(dispatcher: Any) -> Any:
    """The same function, for which a full disk is no error: this process has its machine code anyway."""
    cache = getattr(dispatcher, "_cache", None)
    if cache is None:  # nothing is compiled: NUMBA_DISABLE_JIT
        return dispatcher
    save = cache.save_overload

    def save_overload(signature: object, compiled: object) -> None:
        try:
            save(signature, compiled)
        except OSError as error:
            logger.warning("compiled code cannot be kept in %s (%s)", cache.cache_path, error)

    cache.save_overload = save_overload
    return dispatcher


def _part(function: Callable[P, R], **options: Any) -> Callable[P, R]:
    options |= {"error_model": "numpy", "no_cfunc_wrapper": True}
    return register_jitable(forceinline=True, _nrt=False, **options)(function)  # type: ignore[no-any-return]


@inlined
def copy_matrix(source: NDArray[np.float64], target: NDArray[np.float64]) -> None:
    """Copy a matrix. ``target[:] = source`` would compile for seconds, for the sake of its error message."""
    for i in range(source.shape[0]):
        for j in range(source.shape[1]):
            target[i, j] = source[i, j]
