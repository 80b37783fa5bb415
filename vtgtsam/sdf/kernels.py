# SPDX-License-Identifier: MIT
"""The compiled loops of this folder, in one file since Numba's disk cache follows one file's changes only.

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


@compiled
def closest_on_pads(
    values: Any, lower: Any, scale: Any, T_wo: Any, T_wp: Any, points_p: Any, offsets: Any
) -> Any:
    """Grid point of least distance on each pad, at one object pose.

    Args:
        values: Distances at the grid's nodes.
        lower: Position of the first node.
        scale: Cells per metre.
        T_wo: Object pose, (4, 4).
        T_wp: Pad poses, (K, 4, 4).
        points_p: All pads' points, each in its pad's frame, (P, 3).
        offsets: Pad k's points are offsets[k] to offsets[k + 1].

    Returns:
        Distances (K,), Jacobians for a right perturbation of T_wo (K, 6), indices into points_p (K,).
        Of equal distances the first point counts.
    """
    count = len(T_wp)
    distances = np.empty(count)
    jacobians = np.empty((count, 6))
    indices = np.empty(count, np.int64)
    for k in range(count):
        R, t = relative_pose(T_wo, T_wp[k])
        best, at = np.inf, offsets[k]
        for n in range(offsets[k], offsets[k + 1]):
            x, y, z = transform(R, t, points_p[n])
            phi = trilinear(values, lower, scale, x, y, z)[0]
            if phi < best:
                best, at = phi, n
        x, y, z = transform(R, t, points_p[at])
        phi, gx, gy, gz = trilinear(values, lower, scale, x, y, z)
        distances[k], indices[k] = phi, at
        # dphi/dxi = grad phi^T [skew(p_o) -I] = [(grad phi x p_o)^T  -grad phi^T]
        jacobians[k, 0], jacobians[k, 1], jacobians[k, 2] = (
            gy * z - gz * y,
            gz * x - gx * z,
            gx * y - gy * x,
        )
        jacobians[k, 3], jacobians[k, 4], jacobians[k, 5] = -gx, -gy, -gz
    return distances, jacobians, indices


@compiled
def relative_pose(T_wo: Any, T_wp: Any) -> Any:
    """Rotation (3, 3) and translation (3,) of T_op = T_wo^-1 T_wp."""
    R = np.empty((3, 3))
    t = np.empty(3)
    for i in range(3):
        for j in range(3):
            R[i, j] = T_wo[0, i] * T_wp[0, j] + T_wo[1, i] * T_wp[1, j] + T_wo[2, i] * T_wp[2, j]
        t[i] = (
            T_wo[0, i] * (T_wp[0, 3] - T_wo[0, 3])
            + T_wo[1, i] * (T_wp[1, 3] - T_wo[1, 3])
            + T_wo[2, i] * (T_wp[2, 3] - T_wo[2, 3])
        )
    return R, t


@compiled
def transform(R: Any, t: Any, p: Any) -> Any:
    """Coordinates of R p + t."""
    x = R[0, 0] * p[0] + R[0, 1] * p[1] + R[0, 2] * p[2] + t[0]
    y = R[1, 0] * p[0] + R[1, 1] * p[1] + R[1, 2] * p[2] + t[1]
    z = R[2, 0] * p[0] + R[2, 1] * p[1] + R[2, 2] * p[2] + t[2]
    return x, y, z
