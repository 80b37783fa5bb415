# SPDX-License-Identifier: MIT
"""Which pixels of a depth image show the hand, known from the hand's own geometry and joint angles."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import gtsam
import numpy as np

from ..camera import CameraIntrinsics

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    from ..hands.model import HandModel

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
        rays_c = camera.rays().reshape(-1, 3)
        geom, depth = np.empty(len(rays_c), dtype=np.int32), np.empty(len(rays_c))
        rays_h = (rays_c @ T_hc.rotation().matrix().T).ravel()
        mujoco.mj_multiRay(
            self.hand.model,
            self._data,
            T_hc.translation(),
            rays_h,
            None,
            1,
            -1,
            geom,
            depth,
            None,
            len(rays_c),
            mujoco.mjMAXVAL,
        )
        return np.where(geom >= 0, depth, np.inf).reshape(camera.height, camera.width)

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
