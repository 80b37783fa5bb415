# SPDX-License-Identifier: MIT
"""Compiled loops over a grid: trilinear value and gradient.

A grid is passed as ``values`` (nx, ny, nz) float32, ``lower`` (3,) the position of its first node [m] and
``scale`` (3,) the number of cells per metre along each axis.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiled import compiled


@compiled
def trilinear(values: Any, lower: Any, scale: Any, x: float, y: float, z: float) -> Any:
    """Distance at one point and its gradient, (phi, gx, gy, gz); NaN where the point is not finite.

    Inside the grid phi is trilinear and the gradient its exact derivative. Outside

        phi(x) = phi(c) + |x - c|,    c = x clamped to the grid,

    whose derivative drops the clamped axes of the first term and adds the unit vector of x - c.
    """
    nx, ny, nz = values.shape
    ux, uy, uz = (x - lower[0]) * scale[0], (y - lower[1]) * scale[1], (z - lower[2]) * scale[2]
    if not (np.isfinite(ux) and np.isfinite(uy) and np.isfinite(uz)):
        return np.nan, np.nan, np.nan, np.nan

    # In cells: the clamped coordinate, its cell, and the place inside the cell.
    cx, cy, cz = (
        min(max(ux, 0.0), nx - 1.0),
        min(max(uy, 0.0), ny - 1.0),
        min(max(uz, 0.0), nz - 1.0),
    )
    i, j, k = min(int(cx), nx - 2), min(int(cy), ny - 2), min(int(cz), nz - 2)
    fx, fy, fz = cx - i, cy - j, cz - k

    v000, v001 = np.float64(values[i, j, k]), np.float64(values[i, j, k + 1])
    v010, v011 = np.float64(values[i, j + 1, k]), np.float64(values[i, j + 1, k + 1])
    v100, v101 = np.float64(values[i + 1, j, k]), np.float64(values[i + 1, j, k + 1])
    v110, v111 = np.float64(values[i + 1, j + 1, k]), np.float64(values[i + 1, j + 1, k + 1])

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

    if cx != ux or cy != uy or cz != uz:
        dx, dy, dz = (ux - cx) / scale[0], (uy - cy) / scale[1], (uz - cz) / scale[2]
        outside = np.sqrt(dx * dx + dy * dy + dz * dz)
        phi += outside
        gx = dx / outside if cx != ux else gx
        gy = dy / outside if cy != uy else gy
        gz = dz / outside if cz != uz else gz
    return phi, gx, gy, gz


@compiled
def value_at(values: Any, lower: Any, scale: Any, points: Any) -> Any:
    """Distances at points (N, 3)."""
    distances = np.empty(len(points))
    for n in range(len(points)):
        distances[n] = trilinear(values, lower, scale, points[n, 0], points[n, 1], points[n, 2])[0]
    return distances


@compiled
def value_and_gradient_at(values: Any, lower: Any, scale: Any, points: Any) -> Any:
    """Distances (N,) and gradients (N, 3) at points (N, 3)."""
    distances = np.empty(len(points))
    gradients = np.empty((len(points), 3))
    for n in range(len(points)):
        phi, gx, gy, gz = trilinear(values, lower, scale, points[n, 0], points[n, 1], points[n, 2])
        distances[n] = phi
        gradients[n, 0], gradients[n, 1], gradients[n, 2] = gx, gy, gz
    return distances, gradients

