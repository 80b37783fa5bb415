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
from vtgtsam.rays import RayCaster, RayGrid

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
        self._caster = RayCaster(model, VISIBLE_GROUPS)
        self._rays_c = intrinsics.rays().reshape(-1, 3)
        self._albedo = albedo(model)

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
        origin_w, R_wi = np.asarray(T_wi.translation()), T_wi.rotation().matrix()
        rays = RayGrid.image(self.intrinsics, R_wi, self._rays_c @ R_wi.T)
        met = self._caster.cast(data, origin_w, rays)
        points_w = np.empty_like(rays.rays_w)
        kernels.meet_table(origin_w, rays.rays_w, -TABLE_BELOW, FAR, *met, points_w)
        return points_w, met.normals_w, met.geom

    def _projected(
        self, data: mujoco.MjData, T_wp: gtsam.Pose3, points_w: np.ndarray, normals_w: np.ndarray
    ) -> np.ndarray:
        """The projector's light on surface points, shape (N,)."""
        dots = dots_at(points_w, T_wp)
        light = np.zeros(len(points_w))
        reached = np.flatnonzero(dots > DARK)  # most of a surface lies between dots
        if len(reached) == 0:
            return light
        origin_w, R_wp = np.asarray(T_wp.translation()), T_wp.rotation().matrix()
        ways_w = points_w[reached] - origin_w
        depth = ways_w @ R_wp[:, 2]
        length = np.linalg.norm(ways_w, axis=1)
        facing = np.maximum(-(ways_w * normals_w[reached]).sum(axis=1) / length, 0.0)
        first = self._first(data, origin_w, R_wp, ways_w)
        lit = (1.0 - first) * length < SHADOW_SLACK
        light[reached] = dots[reached] * facing * lit * (REFERENCE_DEPTH / depth) ** 2
        return light

    def _first(
        self, data: mujoco.MjData, origin_w: np.ndarray, R_wp: np.ndarray, ways_w: np.ndarray
    ) -> np.ndarray:
        """Share of each way (N, 3) from the projector after which it meets something, inf if never, shape (N,)."""
        rays, order = RayGrid.sort(R_wp, ways_w, self.intrinsics.fx)
        met = self._caster.cast(data, origin_w, rays)
        first = np.empty(len(ways_w))
        first[order] = np.where(met.geom >= 0, met.distance, np.inf)
        return first
