# SPDX-License-Identifier: MIT
"""A live run's calibration: whose it must be, and what a run that calibrates has found."""

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


def remark(before: Calibration | None, found: Calibration | None) -> str:
    """What a run that calibrates has found, for people."""
    if found is None or found is before:
        return "this grasp has not calibrated anything"
    turn, shift = np.linalg.norm(found.camera[:3]), np.linalg.norm(found.camera[3:])
    return (
        f"calibrated while it worked: the camera is off by {1000 * shift:.1f} mm and {np.rad2deg(turn):.1f} degrees, "
        f"joints by up to {np.rad2deg(np.abs(found.zeros).max()):.1f} degrees. This is not kept: `vtgtsam calibrate` "
        "makes a file of recorded grasps"
    )
