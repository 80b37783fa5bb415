# SPDX-License-Identifier: MIT
"""How far points move, for many transforms."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled, inlined_fast


@compiled
def mean_displacements(
    points: NDArray[np.float64], transforms: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Mean distance [m] of points (P, 3) [m] to where each transform (N, 3, 4) takes them, shape (N,).

    NaN where a transform is not finite.
    """
    means = np.empty(len(transforms))
    for n in range(len(transforms)):
        means[n] = np.nan
        if np.isfinite(transforms[n]).all():
            means[n] = _displacement(points, transforms[n]) / len(points)
    return means


@inlined_fast
def _displacement(points: NDArray[np.float64], rows: NDArray[np.float64]) -> float:
    """Sum of the distances between finite points and where one transform takes them."""
    total = 0.0
    for n in range(len(points)):
        x, y, z = points[n, 0], points[n, 1], points[n, 2]
        dx = rows[0, 0] * x + rows[0, 1] * y + rows[0, 2] * z + rows[0, 3] - x
        dy = rows[1, 0] * x + rows[1, 1] * y + rows[1, 2] * z + rows[1, 3] - y
        dz = rows[2, 0] * x + rows[2, 1] * y + rows[2, 2] * z + rows[2, 3] - z
        total += np.sqrt(dx * dx + dy * dy + dz * dz)
    return total
