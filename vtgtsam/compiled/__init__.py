# SPDX-License-Identifier: MIT
"""Loops compiled with Numba: the decorators, and machine code on disk that fits its sources."""

from .decorators import compiled as compiled
from .decorators import compiled_in_place as compiled_in_place
from .decorators import copy_matrix as copy_matrix
from .decorators import inlined as inlined
from .decorators import inlined_fast as inlined_fast
from .decorators import on_disk as on_disk
