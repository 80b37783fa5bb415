# SPDX-License-Identifier: MIT
"""Put a scene into states that were simulated or recorded earlier, for pictures of it."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from .scene import HAND, OBJECT, WRIST


class Replay:
    """A scene that shows any state of hand and object.

    Attributes:
        model: The scene, as ``sim.scene.build`` makes it.
        data: The state it shows.
    """

    def __init__(self, model: mujoco.MjModel, joint_names: Sequence[str]) -> None:
        self.model = model
        self.data = mujoco.MjData(model)
        self._joints = [model.joint(HAND + name).qposadr[0] for name in joint_names]
        self._wrist = model.joint(WRIST).qposadr[0]
        self._object = model.joint(OBJECT).qposadr[0]

    def show(self, joints: np.ndarray, T_wh: np.ndarray, T_wo: np.ndarray) -> None:
        """Move everything to its place; positions only, no contacts.

        Args:
            joints: Joint angles in the order of the names given [rad], shape (J,).
            T_wh: Pose of the hand, shape (4, 4), which the wrist can reach.
            T_wo: Pose of the object, shape (4, 4).
        """
        qpos = self.data.qpos
        qpos[self._joints] = joints
        qpos[self._wrist] = self._wrist_angle(T_wh[:3, :3])
        qpos[self._object : self._object + 3] = T_wo[:3, 3]
        quat_wxyz = np.empty(4)
        mujoco.mju_mat2Quat(quat_wxyz, T_wo[:3, :3].ravel())
        qpos[self._object + 3 : self._object + 7] = quat_wxyz
        mujoco.mj_kinematics(self.model, self.data)

    def _wrist_angle(self, R_wh: np.ndarray) -> float:
        """The wrist's angle [rad] at which the hand has that orientation (3, 3)."""
        level = np.empty(9)
        mujoco.mju_quat2Mat(level, self.model.body(WRIST).quat)
        turned = np.empty(4)
        mujoco.mju_mat2Quat(turned, (level.reshape(3, 3).T @ R_wh).ravel())
        velocity = np.empty(3)
        mujoco.mju_quat2Vel(velocity, turned, 1.0)
        return float(velocity @ self.model.joint(WRIST).axis)
