# SPDX-License-Identifier: MIT
"""What is compiled at first use, compiled before there is torque: no other thread gets a turn meanwhile."""

from __future__ import annotations

import gtsam
import numpy as np

from vtgtsam import HandModel, Measurement, ObjectModel
from vtgtsam.live.fusion import Estimator
from vtgtsam.vision.depth_tracker import DepthTracker


def warm_up(
    hand: HandModel,
    obj: ObjectModel,
    tracker: DepthTracker,
    estimator: Estimator,
    T_ch: gtsam.Pose3,
    infrared: bool = False,
) -> None:
    """Use tracker and estimator once, and reset the estimator; takes seconds where they were never compiled.

    Args:
        hand: The hand.
        obj: The object.
        tracker: Sees a wall, where the object is and where it is lost.
        estimator: Fuses that with a touch of every pad.
        T_ch: The hand's pose in the camera frame.
        infrared: Whether the tracker is given infrared images.
    """
    T_co = gtsam.Pose3(gtsam.Rot3(), np.array([0.0, 0.0, 0.6]) - obj.center)
    joints = np.zeros(len(hand.joint_names))
    tracker.start(T_co)
    wall = np.full((tracker.camera.height, tracker.camera.width), 0.6)
    gray = np.full(wall.shape, 60, dtype=np.uint8) if infrared else None
    for _ in range(2):  # the second looks for the object
        tracker.update(wall, gtsam.Pose3(), joints, T_ch, gray)
    contacts = np.ones(len(hand), dtype=bool)
    estimator.update(Measurement(0.0, contacts, joints, T_co, T_ch))
    estimator.reset()
