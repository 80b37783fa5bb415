# SPDX-License-Identifier: MIT
"""From where pictures are taken: the camera's place and the side, turned so that all is in sight."""

from __future__ import annotations

from dataclasses import dataclass

import gtsam
import mujoco
import numpy as np

DEFAULT_CAMERA = (0.7, 0.05, 0.6)  # [m], where a recording does not say where its camera is
SIDE = np.array(
    [-0.35, 0.85, 0.4]
)  # direction to the side's view: towards the camera, left of it, up
SIDE_DISTANCE = 1.0  # [m]
MARGIN = 1.06  # the picture is so much wider than what must be in it


@dataclass(frozen=True, eq=False)
class View:
    """A camera that looks from one point at another, z up.

    Attributes:
        position: From where [m], shape (3,), world frame.
        target: At what [m], shape (3,), world frame.
        fovy: Angle from top to bottom [deg].
    """

    position: np.ndarray
    target: np.ndarray
    fovy: float

    def camera(self) -> mujoco.MjvCamera:
        """The same for MuJoCo, which takes the angle from elsewhere."""
        camera = mujoco.MjvCamera()
        forward = self.target - self.position
        camera.lookat[:] = self.target
        camera.distance = np.linalg.norm(forward)
        camera.azimuth = np.rad2deg(np.arctan2(forward[1], forward[0]))
        camera.elevation = np.rad2deg(np.arcsin(forward[2] / camera.distance))
        return camera


def find_views(points: np.ndarray, T_wc: gtsam.Pose3 | None, aspect: float) -> tuple[View, View]:
    """The camera's view and the side's, each with all points in it.

    Args:
        points: What is to be seen [m], shape (N, 3), world frame.
        T_wc: Pose of the recording's camera, None where it is not known.
        aspect: A picture's width over its height.
    """
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    front = np.array(DEFAULT_CAMERA) + middle if T_wc is None else np.asarray(T_wc.translation())
    towards = (front - middle) * (1, 1, 0)
    towards /= np.linalg.norm(towards)
    left = np.cross(towards, (0.0, 0.0, 1.0))
    side = SIDE[0] * towards + SIDE[1] * left + SIDE[2] * np.array([0.0, 0.0, 1.0])
    beside = middle + SIDE_DISTANCE * side / np.linalg.norm(side)
    return _framed(points, front, middle, aspect), _framed(points, beside, middle, aspect)


def _framed(points: np.ndarray, position: np.ndarray, target: np.ndarray, aspect: float) -> View:
    """The view from a position that has all points in it as large as they fit."""
    for _ in range(3):  # turning the camera moves the middle a little
        right, up, forward = _axes(position, target)
        away = points - position
        depth = away @ forward
        u, v = away @ right / depth, away @ up / depth
        middle_u, middle_v = (u.min() + u.max()) / 2, (v.min() + v.max()) / 2
        distance = float(np.median(depth))
        target = position + distance * (forward + middle_u * right + middle_v * up)
    height = MARGIN * max(np.ptp(v), np.ptp(u) / aspect)
    return View(position, target, float(np.rad2deg(2 * np.arctan(height / 2))))


def _axes(position: np.ndarray, target: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    forward = (target - position) / np.linalg.norm(target - position)
    right = np.cross(forward, (0.0, 0.0, 1.0))
    right /= np.linalg.norm(right)
    return right, np.cross(right, forward), forward
