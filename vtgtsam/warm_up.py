# SPDX-License-Identifier: MIT
"""Everything that is compiled for this machine, compiled once: for images and robots, whose first pose should not wait.

The machine code is kept beside the package, and a built-in object's distance field in the cache (``VTGTSAM_CACHE``).
"""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec

import gtsam
import numpy as np

from .camera import CameraIntrinsics
from .config import EstimatorConfig
from .estimator import PoseEstimator
from .hands.pads import Pad, PadSet
from .measurement import Measurement
from .metrics import Adds, add_each, relative_poses
from .objects import ObjectModel, load_object
from .vision.depth_tracker import FORMS, make_tracker

DISTANCE = 0.5  # [m], of the object before the camera


def warm_up(tell: Callable[[str], None] = lambda part: None) -> None:
    """Run each compiled part once.

    Args:
        tell: Called with the name of each part before it.
    """
    tell("distance fields")
    can = load_object("can")
    tell("the estimator")
    _estimate(can)
    tell("errors against the truth")
    _compare(can)
    tell("the depth tracker")
    _track(can)


def _estimate(can: ObjectModel) -> None:
    """Frames of a hand by its pads alone, and of one with joints where MuJoCo is installed."""
    pads = PadSet([Pad("pad", (0.02, 0.02))])
    frame = Measurement(0.0, [True], T_wp=np.eye(4)[None], T_wo_visual=gtsam.Pose3())
    for config in (EstimatorConfig(), EstimatorConfig.simulation()):
        PoseEstimator(pads, can, config).update(frame)
    if find_spec("mujoco") is None:
        return
    from .hands.model import load_hand

    hand = load_hand("isyhand")
    joints = dict.fromkeys(hand.joint_names, 0.3)
    touching = dict.fromkeys(hand.pad_names, True)
    seen = gtsam.Pose3(gtsam.Rot3(), [0.1, 0.05, 0.1])
    PoseEstimator(hand, can).update(
        Measurement(0.0, touching, joints=joints, T_wo_visual=seen, T_wh=gtsam.Pose3())
    )


def _compare(can: ObjectModel) -> None:
    truth, off = gtsam.Pose3(), gtsam.Pose3(gtsam.Rot3(), [1e-3, 0.0, 0.0])
    distance = Adds(can.mesh)
    distance(off, truth)
    relative = relative_poses([off], [truth])
    distance.each(relative)
    add_each(can.mesh, relative)


def _track(can: ObjectModel) -> None:
    """An image of a wall where the object is expected: the tracker aligns, gives up and searches."""
    camera = CameraIntrinsics(160, 120, 150.0, 150.0, 79.5, 59.5)
    wall = np.full((camera.height, camera.width), DISTANCE)
    hand = None
    if find_spec("mujoco") is not None:
        from .hands.model import load_hand

        hand = load_hand("isyhand")
    for form in FORMS:
        if hand is None and form != "depth":
            continue
        tracker = make_tracker(form, can, camera, hand)
        tracker.start(gtsam.Pose3(gtsam.Rot3(), [0.0, 0.0, DISTANCE]))
        joints = None if hand is None else dict.fromkeys(hand.joint_names, 0.3)
        infrared = np.full(wall.shape, 60, dtype=np.uint8)
        tracker.update(wall, gtsam.Pose3(), joints, gtsam.Pose3(), infrared)
