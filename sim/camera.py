# SPDX-License-Identifier: MIT
"""The simulated depth camera: ray casting, which needs no graphics driver, and the paper's noise.

Intrinsics and noise follow the paper (section "Simulation Experiment Setup"), a RealSense D435; its place is the
scene's matter.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import gtsam
import numpy as np

from vtgtsam.camera import CameraIntrinsics
from vtgtsam.rays import RayCaster, RayGrid

if TYPE_CHECKING:
    import mujoco

# Depth aligned to the colour image, as trackers of RGB-D images use it. The D435's colour camera sees 42.5
# degrees from top to bottom (its datasheet; +-3 degrees): f = 240 / tan(21.3 deg) = 615 pixels.
D435 = CameraIntrinsics(width=640, height=480, fx=615.0, fy=615.0, cx=319.5, cy=239.5)
MAX_RANGE = 3.0  # [m], end of the range Intel calls ideal for it
VISIBLE_GROUPS = (0, 1, 2)  # the geom groups MuJoCo shows by default; contact-only geometry is in 3


class DepthCamera:
    """Depth images of a MuJoCo scene by ray casting.

    Rays meet exact surfaces: a mesh geom is seen as its triangles, so the object's true mesh must be in one
    of ``groups`` and the convex parts made for contact in none.

    Args:
        model: The compiled scene.
        intrinsics: Size and focal lengths, for example ``D435.scaled(0.5)`` or a crop.
        groups: Geom groups that are seen.
    """

    def __init__(
        self,
        model: mujoco.MjModel,
        intrinsics: CameraIntrinsics,
        groups: tuple[int, ...] = VISIBLE_GROUPS,
    ) -> None:
        self.intrinsics = intrinsics
        self._caster = RayCaster(model, groups)
        self._rays_c = intrinsics.rays().reshape(-1, 3)

    def render(self, data: mujoco.MjData, T_wc: gtsam.Pose3) -> tuple[np.ndarray, np.ndarray]:
        """The exact image at the poses ``data`` holds (after ``mj_kinematics``).

        Returns:
            Depth [m], 0 where nothing is within range, and the geom seen, -1 where none; each of shape
            (height, width).
        """
        R_wc = T_wc.rotation().matrix()
        rays = RayGrid.image(self.intrinsics, R_wc, self._rays_c @ R_wc.T)
        # A ray of depth 1 m: distance counts in lengths of the ray, so it is the depth itself.
        met = self._caster.cast(data, np.asarray(T_wc.translation()), rays)
        shape = (self.intrinsics.height, self.intrinsics.width)
        seen = (met.geom >= 0) & (met.distance <= MAX_RANGE)
        depth = np.where(seen, met.distance, 0.0).reshape(shape)
        return depth, np.where(seen, met.geom, -1).reshape(shape)


def depth_sigma(depth: np.ndarray) -> np.ndarray:
    """Standard deviation of the D435's depth [m] at a depth [m], any shape.

    sigma(d) = 0.001063 + 0.0007278 d + 0.003949 d^2 (paper, after Ahn et al. 2019)
    """
    return 0.001063 + 0.0007278 * depth + 0.003949 * depth**2


def add_depth_noise(depth: np.ndarray, rng: np.random.Generator, scale: float = 1.0) -> np.ndarray:
    """A depth image [m] with the paper's Gaussian noise times ``scale``; 0 stays 0 (nothing measured)."""
    noisy = depth + scale * depth_sigma(depth) * rng.standard_normal(depth.shape)
    return np.where(depth > 0.0, np.maximum(noisy, 1e-3), 0.0)
