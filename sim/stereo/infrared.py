# SPDX-License-Identifier: MIT
"""Infrared images of a scene, ray cast: projector dots, Lambert's law, shadow, a table behind.

The brightness of a surface point at distance z of the projector is

    albedo grain (ambient (0.5 + 0.5 n_up) + lit dots (n . l) (z_0 / z)^2)

with n the normal, l the direction to the projector and lit whether it sees the point.
"""

from __future__ import annotations

import cv2
import gtsam
import mujoco
import numpy as np

from vtgtsam.camera import CameraIntrinsics

from ..camera import VISIBLE_GROUPS
from . import kernels, rig
from .pattern import dots_at
from .surface import albedo, grain

FAR = 5.0  # [m], rays are followed so far; the table ends all that point down
TABLE_BELOW = 0.30  # [m], the table is so far below the world's origin, the hand's wrist
AMBIENT = 0.15  # brightness of ambient light on a white surface that faces up, of a dot's 1 at z_0
REFERENCE_DEPTH = 0.6  # [m], z_0
SHADOW_SLACK = 0.002  # [m], a point so little behind the first surface of a ray is that surface
DARK = 0.03  # of a dot's brightness; less light is none
LENS_BLUR = 0.6  # [pixels]


class InfraredCamera:
    """One imager and the projector beside it.

    Args:
        model: The compiled scene.
        intrinsics: Of the imager.
        right: How far the imager is right of the left one [m].
    """

    def __init__(
        self, model: mujoco.MjModel, intrinsics: CameraIntrinsics, right: float = 0.0
    ) -> None:
        self.model, self.intrinsics, self._right = model, intrinsics, right
        self._rays_c = intrinsics.rays().reshape(-1, 3)
        self._groups = np.isin(np.arange(6), VISIBLE_GROUPS).astype(np.uint8)
        self._albedo = albedo(model)
        self._far = FAR * float(np.linalg.norm(self._rays_c, axis=1).max())

    def render(self, data: mujoco.MjData, T_wc: gtsam.Pose3) -> np.ndarray:
        """The image without noise at the poses ``data`` holds, brightness, shape (height, width), float32.

        Args:
            data: The scene after ``mj_kinematics``.
            T_wc: Pose of the left imager.
        """
        T_wi = rig.beside(T_wc, self._right)
        points_w, normals_w, geom = self._surface(data, T_wi)
        light = AMBIENT * (0.5 + 0.5 * normals_w[:, 2])
        light += self._projected(data, rig.beside(T_wc, rig.PROJECTOR), points_w, normals_w)
        light *= self._albedo[geom] * grain(self.model, data, points_w, geom)
        image = light.reshape(self.intrinsics.height, self.intrinsics.width).astype(np.float32)
        blurred: np.ndarray = cv2.GaussianBlur(image, (5, 5), LENS_BLUR)
        return blurred

    def _surface(
        self, data: mujoco.MjData, T_wi: gtsam.Pose3
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Where the pixels' rays end [m], the normals there, each (N, 3), and the geom, -1 the table, (N,)."""
        origin_w = np.asarray(T_wi.translation())
        rays_w = self._rays_c @ T_wi.rotation().matrix().T
        geom, distance, normals_w = self._cast(data, origin_w, rays_w, self._far)
        points_w = np.empty_like(rays_w)
        kernels.meet_table(origin_w, rays_w, -TABLE_BELOW, FAR, geom, distance, normals_w, points_w)
        return points_w, normals_w, geom

    def _cast(
        self, data: mujoco.MjData, origin_w: np.ndarray, rays_w: np.ndarray, cutoff: float
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Geom (-1: none), distance in lengths of the ray, and normal of the first hit of each ray."""
        count = len(rays_w)
        geom, distance = np.empty(count, dtype=np.int32), np.empty(count)
        normals_w = np.zeros(3 * count)
        mujoco.mj_multiRay(
            self.model, data, origin_w, rays_w.ravel(), self._groups, 1, -1,
            geom, distance, normals_w, count, cutoff,
        )  # fmt: skip
        return geom, distance, normals_w.reshape(-1, 3)

    def _projected(
        self, data: mujoco.MjData, T_wp: gtsam.Pose3, points_w: np.ndarray, normals_w: np.ndarray
    ) -> np.ndarray:
        """The projector's light on surface points, shape (N,)."""
        dots = dots_at(points_w, T_wp)
        light = np.zeros(len(points_w))
        reached = np.flatnonzero(dots > DARK)  # most of a surface lies between dots
        if len(reached) == 0:
            return light
        origin_w = np.asarray(T_wp.translation())
        ways_w = points_w[reached] - origin_w
        depth = ways_w @ T_wp.rotation().matrix()[:, 2]
        length = np.linalg.norm(ways_w, axis=1)
        facing = np.maximum(-(ways_w * normals_w[reached]).sum(axis=1) / length, 0.0)
        geom, first, _ = self._cast(data, origin_w, ways_w, float(length.max()))
        lit = (geom < 0) | ((1.0 - first) * length < SHADOW_SLACK)
        light[reached] = dots[reached] * facing * lit * (REFERENCE_DEPTH / depth) ** 2
        return light
