# SPDX-License-Identifier: MIT
"""Compiled loops over a grid: trilinear value and gradient.

A grid is passed as ``values`` (nx, ny, nz) float32, ``lower`` (3,) the position of its first node [m] and
``scale`` (3,) the number of cells per metre along each axis.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled, inlined


@inlined
def trilinear(
    values: NDArray[np.float32],
    lower: NDArray[np.float64],
    scale: NDArray[np.float64],
    x: float,
    y: float,
    z: float,
) -> tuple[float, float, float, float]:
    """Distance [m] at one point [m] and its gradient, (phi, gx, gy, gz); NaN where the point is not finite.

    Inside the grid phi is trilinear and the gradient its exact derivative. Outside

        phi(x) = phi(c) + |x - c|,    c = x clamped to the grid,

    whose derivative drops the clamped axes of the first term and adds the unit vector of x - c.
    """
    nx, ny, nz = values.shape
    u, v, w = (x - lower[0]) * scale[0], (y - lower[1]) * scale[1], (z - lower[2]) * scale[2]
    if 0.0 <= u < nx - 1 and 0.0 <= v < ny - 1 and 0.0 <= w < nz - 1:
        return in_cell(values, scale, int(u), int(v), int(w), u, v, w)
    if not (np.isfinite(u) and np.isfinite(v) and np.isfinite(w)):
        return np.nan, np.nan, np.nan, np.nan

    cu, cv, cw = min(max(u, 0.0), nx - 1.0), min(max(v, 0.0), ny - 1.0), min(max(w, 0.0), nz - 1.0)
    i, j, k = min(int(cu), nx - 2), min(int(cv), ny - 2), min(int(cw), nz - 2)
    phi, gx, gy, gz = in_cell(values, scale, i, j, k, cu, cv, cw)
    dx, dy, dz = (u - cu) / scale[0], (v - cv) / scale[1], (w - cw) / scale[2]
    outside = math.sqrt(dx * dx + dy * dy + dz * dz)
    gx = dx / outside if cu != u else gx
    gy = dy / outside if cv != v else gy
    gz = dz / outside if cw != w else gz
    return phi + outside, gx, gy, gz


@inlined
def in_cell(
    values: NDArray[np.float32],
    scale: NDArray[np.float64],
    i: int,
    j: int,
    k: int,
    u: float,
    v: float,
    w: float,
) -> tuple[float, float, float, float]:
    """Trilinear value [m] and its derivative in cell (i, j, k), at (u, v, w) cells from the first node."""
    fx, fy, fz = u - i, v - j, w - k
    # Unsigned: a signed index might count from the end, and asking costs more than the interpolation.
    i0, j0, k0 = np.uint64(i), np.uint64(j), np.uint64(k)
    i1, j1, k1 = np.uint64(i + 1), np.uint64(j + 1), np.uint64(k + 1)
    v000, v001 = np.float64(values[i0, j0, k0]), np.float64(values[i0, j0, k1])
    v010, v011 = np.float64(values[i0, j1, k0]), np.float64(values[i0, j1, k1])
    v100, v101 = np.float64(values[i1, j0, k0]), np.float64(values[i1, j0, k1])
    v110, v111 = np.float64(values[i1, j1, k0]), np.float64(values[i1, j1, k1])

    # Along z, then y, then x; each derivative differs in its own axis only.
    v00, v01 = v000 + fz * (v001 - v000), v010 + fz * (v011 - v010)
    v10, v11 = v100 + fz * (v101 - v100), v110 + fz * (v111 - v110)
    v0, v1 = v00 + fy * (v01 - v00), v10 + fy * (v11 - v10)
    phi = v0 + fx * (v1 - v0)
    gx = (v1 - v0) * scale[0]
    gy = ((v01 - v00) + fx * ((v11 - v10) - (v01 - v00))) * scale[1]
    dz0 = (v001 - v000) + fy * ((v011 - v010) - (v001 - v000))
    dz1 = (v101 - v100) + fy * ((v111 - v110) - (v101 - v100))
    gz = (dz0 + fx * (dz1 - dz0)) * scale[2]
    return phi, gx, gy, gz


@compiled
def steepest(values: NDArray[np.float32], scale: NDArray[np.float64]) -> float:
    """Bound of the gradient's norm in all cells: each component is between the slopes of the cell's edges."""
    nx, ny, nz = values.shape
    most = 0.0
    for i in range(nx - 1):
        for j in range(ny - 1):
            for k in range(nz - 1):
                ex = ey = ez = np.float32(0)
                for a in range(2):
                    for b in range(2):
                        ex = max(ex, abs(values[i + 1, j + a, k + b] - values[i, j + a, k + b]))
                        ey = max(ey, abs(values[i + a, j + 1, k + b] - values[i + a, j, k + b]))
                        ez = max(ez, abs(values[i + a, j + b, k + 1] - values[i + a, j + b, k]))
                gx, gy, gz = ex * scale[0], ey * scale[1], ez * scale[2]
                most = max(most, gx * gx + gy * gy + gz * gz)
    return math.sqrt(most) * (1 + 1e-6)  # float32 differences


@compiled
def value_at(
    values: NDArray[np.float32],
    lower: NDArray[np.float64],
    scale: NDArray[np.float64],
    points: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Distances [m], shape (N,), at points (N, 3) [m]."""
    distances = np.empty(len(points))
    for n in range(len(points)):
        distances[n] = trilinear(values, lower, scale, points[n, 0], points[n, 1], points[n, 2])[0]
    return distances


@compiled
def value_and_gradient_at(
    values: NDArray[np.float32],
    lower: NDArray[np.float64],
    scale: NDArray[np.float64],
    points: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Distances [m], shape (N,), and gradients, shape (N, 3), at points (N, 3) [m]."""
    distances = np.empty(len(points))
    gradients = np.empty((len(points), 3))
    for n in range(len(points)):
        phi, gx, gy, gz = trilinear(values, lower, scale, points[n, 0], points[n, 1], points[n, 2])
        distances[n] = phi
        gradients[n, 0], gradients[n, 1], gradients[n, 2] = gx, gy, gz
    return distances, gradients
