# SPDX-License-Identifier: MIT
"""Where noise is learnt: how far pixels are from an edge, and which of them err together."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled


@compiled
def zones(
    front: NDArray[np.float64],
    predicted: NDArray[np.float64],
    jump: float,
    steep: float,
    near: int,
    zone: NDArray[np.int64],
) -> None:
    """Say how many pixels away an edge is, for each pixel of the object that nothing covers.

    ``zone`` (height, width) gets steps - 1 where the nearest other depth is smaller than the object's, near + steps
    - 1 where it is larger, and is left as it is where there is none within ``near`` steps, diagonal ones included.
    An edge is a difference of more than ``jump`` [m] and ``steep`` times the depth for each step.

    Args:
        front: What the camera should see [m], inf where that is nothing, shape (height, width).
        predicted: The object alone, same shape.
        jump: See above.
        steep: See above.
        near: See above.
        zone: See above.
    """
    height, width = front.shape
    for v in range(height):
        for u in range(width):
            z = predicted[v, u]
            if z == np.inf or front[v, u] < z - jump:
                continue
            found = False
            for steps in range(1, near + 1):
                least = jump + steep * z * steps
                nearer, farther = False, False
                for b in range(max(v - steps, 0), min(v + steps + 1, height)):
                    whole = abs(b - v) == steps
                    for a in range(max(u - steps, 0), min(u + steps + 1, width)):
                        if whole or abs(a - u) == steps:
                            nearer = nearer or front[b, a] < z - least
                            farther = farther or front[b, a] > z + least
                if nearer or farther:
                    zone[v, u] = steps - 1 if nearer else near + steps - 1
                    found = True
                if found:
                    break


@compiled
def products(residual: NDArray[np.float64], lags: int, sums: NDArray[np.float64]) -> None:
    """Add products of residuals (height, width) some pixels apart in a row and a column; NaN where there is none.

    ``sums`` (2, lags + 1, 2) gets, for rows and columns and each lag from 0, the sum of the products and of the
    mean squares of the two.
    """
    height, width = residual.shape
    for v in range(height):
        for u in range(width):
            r = residual[v, u]
            if np.isnan(r):
                continue
            for lag in range(lags + 1):
                for axis in range(2):
                    b, a = (v, u + lag) if axis == 0 else (v + lag, u)
                    if b < height and a < width and not np.isnan(residual[b, a]):
                        other = residual[b, a]
                        sums[axis, lag, 0] += r * other
                        sums[axis, lag, 1] += 0.5 * (r * r + other * other)
