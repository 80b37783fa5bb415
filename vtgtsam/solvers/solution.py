# SPDX-License-Identifier: MIT
"""What a solver returns."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Solution(NamedTuple):
    """Where a solver ended.

    Attributes:
        T_wo: The pose, shape (4, 4).
        moved: Whether that is another pose than the start.
        iterations: Steps taken.
        error: Cost there, 1/2 sum rho.
    """

    T_wo: np.ndarray
    moved: bool
    iterations: int
    error: float
