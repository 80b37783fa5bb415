# SPDX-License-Identifier: MIT
"""One decorator for loops compiled with Numba."""

from __future__ import annotations

import logging
from collections.abc import Callable
from typing import Any

import numba

logger = logging.getLogger(__name__)


def compiled(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile with Numba, keeping the machine code on disk where the installation allows it.

    Numba raises already at import where it finds no folder to write its cache to (a read-only install
    with no home directory): then the loop is compiled anew in each process instead.
    """
    options = {"nogil": True, "error_model": "numpy"}
    try:
        return numba.njit(cache=True, **options)(function)  # type: ignore[no-any-return]
    except RuntimeError as error:
        logger.debug("%s: compiled without a cache on disk (%s)", function.__name__, error)
        return numba.njit(**options)(function)  # type: ignore[no-any-return]
