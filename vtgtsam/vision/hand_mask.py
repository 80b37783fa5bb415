# SPDX-License-Identifier: MIT
"""Which pixels of a depth image show the hand, known from the hand's own geometry and joint angles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import gtsam
import numpy as np

from ..camera import CameraIntrinsics
from ..rays import RayCaster, RayGrid

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ..hands.model import HandModel

EVERY_GROUP = tuple(range(6))  # of geoms, as MuJoCo numbers them
TOLERANCE = 0.01  # [m], a surface at most this far in front of the hand's still counts as the hand


class HandMask:
    """Finds the hand's pixels by casting rays at the hand's model alone.

    Args:
        hand: The hand; all its geometry is seen, whatever its group.
        tolerance: A pixel is the hand where its depth is at or behind the hand's own, less this [m]. It
            covers the camera's noise and small errors of joints and calibration.
    """

    def __init__(self, hand: HandModel, tolerance: float = TOLERANCE) -> None:
        import mujoco

        self.hand = hand
        self.tolerance = tolerance
        self._data = mujoco.MjData(hand.model)
        self._caster = RayCaster(hand.model, EVERY_GROUP)

    def depth(
        self,
        camera: CameraIntrinsics,
        T_hc: gtsam.Pose3,
        joints: ArrayLike | Mapping[str, float],
    ) -> np.ndarray:
        """Depth [m] of the hand alone, inf beside it, shape (height, width).

        Args:
            camera: The image's intrinsics.
            T_hc: Pose of the camera in the hand's root frame.
            joints: Joint angles [rad].
        """
        import mujoco

        self._data.qpos[:] = self.hand.joint_array(joints)  # hinges and slides: one number each
        mujoco.mj_kinematics(self.hand.model, self._data)
        R_hc = T_hc.rotation().matrix()
        # A ray of depth 1 m: distance counts in lengths of the ray, so it is the depth itself.
        rays = RayGrid.image(camera, R_hc, camera.rays().reshape(-1, 3) @ R_hc.T)
        met = self._caster.cast(self._data, np.asarray(T_hc.translation()), rays)
        depth = np.where(met.geom >= 0, met.distance, np.inf)
        return depth.reshape(camera.height, camera.width)

    def mask(
        self,
        depth: np.ndarray,
        camera: CameraIntrinsics,
        T_hc: gtsam.Pose3,
        joints: ArrayLike | Mapping[str, float],
    ) -> np.ndarray:
        """True where a depth image [m] shows the hand, or what lies behind it; shape (height, width)."""
        return self.covers(depth, self.depth(camera, T_hc, joints))

    def covers(self, depth: np.ndarray, hand_depth: np.ndarray) -> np.ndarray:
        """The same, with the hand's own depth [m] at hand."""
        mask: np.ndarray = depth >= hand_depth - self.tolerance
        return mask
