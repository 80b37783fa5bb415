# SPDX-License-Identifier: MIT
"""A live run's calibration: whose it must be, and how the camera sees the hand."""

from __future__ import annotations

import gtsam
import numpy as np

from vtgtsam import Calibration, HandModel
from vtgtsam.calibration.robot import Robot


def robot_of(hand: HandModel, camera: str, calibration: Calibration | None) -> Robot:
    """The robot of a run, whose world is the camera's frame.

    Args:
        hand: Its hand.
        camera: Its camera's name.
        calibration: What it is to be corrected with.

    Raises:
        CalibrationError: That is of another hand or camera.
    """
    robot = Robot(hand.name, hand.joint_names, camera, gtsam.Pose3())
    if calibration is not None:
        calibration.check_hand(hand)
        calibration.robot.check_camera(robot)
    return robot


def as_seen(
    calibration: Calibration | None, joints: np.ndarray, T_wh: gtsam.Pose3
) -> tuple[np.ndarray, gtsam.Pose3]:
    """Joints and hand as the camera's image has them, from what is measured and believed.

    A tracker that knows the hand leaves it out of the image: at its true joints, and off by what the camera is off.
    """
    if calibration is None:
        return joints, T_wh
    return joints - calibration.zeros, calibration.camera_motion.compose(T_wh)
