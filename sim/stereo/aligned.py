# SPDX-License-Identifier: MIT
"""A depth image as another camera beside it would have it, as librealsense aligns depth to colour."""

from __future__ import annotations

import gtsam
import numpy as np

from vtgtsam.camera import CameraIntrinsics


def aligned(
    depth: np.ndarray, camera: CameraIntrinsics, other: CameraIntrinsics, T_dc: gtsam.Pose3
) -> np.ndarray:
    """The depth image of the other camera [m], shape (height, width), 0 where nothing is known.

    Each pixel is a square that faces the camera; where several fall on one pixel of the other camera, the
    nearest is seen. What only the other camera sees stays unknown.

    Args:
        depth: The image [m], shape (height, width), 0 where nothing was measured.
        camera: Its intrinsics.
        other: The other camera's.
        T_dc: The other camera in the first one's frame; it looks the same way.
    """
    v, u = np.nonzero(depth > 0.0)
    z = depth[v, u]
    corners = [_seen(u + side, v + side, z, camera, other, T_dc) for side in (-0.5, 0.5)]
    (u0, v0, _), (u1, v1, z_c) = corners
    first_u, last_u = np.ceil(u0).astype(int), np.ceil(u1).astype(int)  # [first, last)
    first_v, last_v = np.ceil(v0).astype(int), np.ceil(v1).astype(int)
    image = np.full((other.height, other.width), np.inf)
    for down in range(int((last_v - first_v).max(initial=0))):
        for right in range(int((last_u - first_u).max(initial=0))):
            a, b = first_u + right, first_v + down
            inside = (a < last_u) & (b < last_v) & (z_c > 0.0)
            inside &= (0 <= a) & (a < other.width) & (0 <= b) & (b < other.height)
            np.minimum.at(image, (b[inside], a[inside]), z_c[inside])
    return np.where(np.isfinite(image), image, 0.0)


def _seen(
    u: np.ndarray,
    v: np.ndarray,
    z: np.ndarray,
    camera: CameraIntrinsics,
    other: CameraIntrinsics,
    T_dc: gtsam.Pose3,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Pixel (u, v) and depth [m] in the other camera of points at pixels and depths of the first."""
    points_d = np.stack([(u - camera.cx) / camera.fx * z, (v - camera.cy) / camera.fy * z, z])
    points_c = T_dc.transformTo(points_d)
    z_c = np.maximum(points_c[2], 1e-6)
    return (
        points_c[0] / z_c * other.fx + other.cx,
        points_c[1] / z_c * other.fy + other.cy,
        points_c[2],
    )
