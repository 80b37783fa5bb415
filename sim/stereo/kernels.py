# SPDX-License-Identifier: MIT
"""The compiled loops of the infrared images."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vtgtsam.compiled import compiled


@compiled
def meet_table(
    origin_w: NDArray[np.float64],
    rays_w: NDArray[np.float64],
    height: float,
    far: float,
    geom: NDArray[np.int32],
    distance: NDArray[np.float64],
    normals_w: NDArray[np.float64],
    points_w: NDArray[np.float64],
) -> None:
    """Let rays (N, 3) that meet nothing before the table at ``height`` [m] end there, or at ``far`` rays' lengths.

    ``geom`` (-1: nothing, and the table), ``distance`` in lengths of the ray and ``normals_w`` (N, 3) are what they
    met, and are changed; ``points_w`` (N, 3) is filled.
    """
    for n in range(len(rays_w)):
        end = far
        if rays_w[n, 2] != 0.0:
            at = (height - origin_w[2]) / rays_w[n, 2]
            if 0.0 < at < far:
                end = at
        if geom[n] < 0 or end < distance[n]:
            geom[n], distance[n] = -1, end
            normals_w[n, 0], normals_w[n, 1], normals_w[n, 2] = 0.0, 0.0, 1.0
        for i in range(3):
            points_w[n, i] = origin_w[i] + distance[n] * rays_w[n, i]


@compiled
def look_up(
    points_w: NDArray[np.float64],
    origin_w: NDArray[np.float64],
    R_wp: NDArray[np.float64],
    pattern: NDArray[np.float32],
    resolution: float,
    bright: NDArray[np.float64],
) -> None:
    """Fill ``bright`` (N,) with the pattern's brightness at points, bilinear; 0 beside it.

    ``resolution`` is the pattern's pixels a metre on a plane 1 m before the projector; its middle is on the axis.
    """
    rows, columns = pattern.shape
    for n in range(len(points_w)):
        x, y, z = 0.0, 0.0, 0.0
        for i in range(3):
            way = points_w[n, i] - origin_w[i]
            x, y, z = x + R_wp[i, 0] * way, y + R_wp[i, 1] * way, z + R_wp[i, 2] * way
        bright[n] = 0.0
        if z <= 0.0:
            continue
        u, v = x / z * resolution + (columns - 1) / 2, y / z * resolution + (rows - 1) / 2
        if not (0.0 <= u < columns - 1 and 0.0 <= v < rows - 1):
            continue
        a, b = int(u), int(v)
        right, down = u - a, v - b
        bright[n] = (1.0 - down) * ((1.0 - right) * pattern[b, a] + right * pattern[b, a + 1]) + (
            down * ((1.0 - right) * pattern[b + 1, a] + right * pattern[b + 1, a + 1])
        )


@compiled
def grain(
    points_w: NDArray[np.float64],
    geom: NDArray[np.int32],
    body: NDArray[np.int32],
    R_wb: NDArray[np.float64],
    t_wb: NDArray[np.float64],
    table: NDArray[np.float32],
    cell: float,
    noise: NDArray[np.float64],
) -> None:
    """Fill ``noise`` (N,) with a table (M, M, M) that fills space again and again, trilinear, at points.

    Each point counts in the frame of its geom's body (-1: the world's), of which ``R_wb`` (B, 3, 3) and ``t_wb``
    (B, 3) are the poses; M is a power of two and ``cell`` [m] the distance of the table's nodes.
    """
    mask = table.shape[0] - 1
    near, far, right = np.empty(3, dtype=np.int64), np.empty(3, dtype=np.int64), np.empty(3)
    for n in range(len(points_w)):
        b = body[geom[n]] if geom[n] >= 0 else 0
        for i in range(3):
            at = 0.0
            for j in range(3):
                at += R_wb[b, j, i] * (points_w[n, j] - t_wb[b, j])
            at /= cell
            floor = np.floor(at)
            near[i], far[i], right[i] = int(floor) & mask, (int(floor) + 1) & mask, at - floor
        total = 0.0
        for z in range(2):
            for y in range(2):
                i, j = near[0], far[1] if y else near[1]
                k, by_z = (far[2], right[2]) if z else (near[2], 1.0 - right[2])
                by_y = right[1] if y else 1.0 - right[1]
                total += (1.0 - right[0]) * by_y * by_z * table[i, j, k]
                total += right[0] * by_y * by_z * table[far[0], j, k]
        noise[n] = total
