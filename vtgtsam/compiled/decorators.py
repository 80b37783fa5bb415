# SPDX-License-Identifier: MIT
"""Three decorators for loops compiled with Numba."""

from __future__ import annotations

import logging
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba

from .stale import drop_stale

drop_stale(Path(__file__).parents[1])

logger = logging.getLogger(__name__)

Function = Callable[..., Any]


def compiled(function: Function) -> Function:
    """Compile with Numba to exact floating-point arithmetic.

    The machine code is kept on disk where the installation allows it. Numba raises already at import where it
    finds no folder to write to (a read-only install with no home directory): then each process compiles anew.
    """
    return _compile(function)


def inlined(function: Function) -> Function:
    """Compile like ``compiled``, and merge into the compiled functions that call it.

    For small parts of a loop: a call that passes arrays costs more than they do.
    """
    return _compile(function, forceinline=True)


def inlined_fast(function: Function) -> Function:
    """Compile like ``inlined``, but let the compiler reorder and fuse operations, so that it can vectorise.

    Only for loops whose rounding is bounded by whoever uses the result, and whose values are finite.
    """
    return _compile(
        function, forceinline=True, fastmath={"reassoc", "contract", "nsz", "arcp", "nnan"}
    )


def _compile(function: Function, **options: Any) -> Function:
    options |= {"nogil": True, "error_model": "numpy"}
    try:
        return numba.njit(cache=True, **options)(function)  # type: ignore[no-any-return]
    except RuntimeError as error:
        logger.debug("%s: compiled without a cache on disk (%s)", function.__name__, error)
        return numba.njit(**options)(function)  # type: ignore[no-any-return]


@inlined
def copy_matrix(source: Any, target: Any) -> None:
    """Copy a matrix. ``target[:] = source`` would compile for seconds, for the sake of its error message."""
    for i in range(source.shape[0]):
        for j in range(source.shape[1]):
            target[i, j] = source[i, j]
