# SPDX-License-Identifier: MIT
"""A pose from the installed package: of the core alone, or with the extra ``all`` of a hand by its file as well."""

import sys

import gtsam
import numpy as np

import vtgtsam
from vtgtsam import Measurement, Pad, PadSet, PoseEstimator, VtgtsamError, load_object

assert "site-packages" in vtgtsam.__file__, vtgtsam.__file__
can = load_object("can")
# A pad on the side of a can, whose visual pose is 3 mm off.
T_wp = np.eye(4)
T_wp[:3, :3] = gtsam.Rot3.Ry(-np.pi / 2).matrix()
T_wp[0, 3] = can.mesh.vertices[:, 0].max()
estimator = PoseEstimator(PadSet([Pad("pad", (0.02, 0.02))]), can)
visual = gtsam.Pose3(gtsam.Rot3(), [-0.003, 0.0, 0.0])
estimate = estimator.update(Measurement(0.0, [True], T_wp=T_wp[None], T_wo_visual=visual))
assert estimate.status == "ok", estimate
assert abs(estimate.pad_distances[0]) < 0.003, estimate.pad_distances

if sys.argv[1:] == ["all"]:
    from vtgtsam import evaluate, load_hand, read_recording  # noqa: F401

    hand = load_hand("isyhand")
    estimate = PoseEstimator(hand, can).update(
        Measurement(
            0.0,
            dict.fromkeys(hand.pad_names, False),
            joints=dict.fromkeys(hand.joint_names, 0.0),
            T_wo_visual=gtsam.Pose3(gtsam.Rot3(), [0.3, 0.0, 0.0]),
            T_wh=gtsam.Pose3(),
        )
    )
    assert estimate.status == "ok", estimate
else:
    try:
        from vtgtsam import load_hand

        raise AssertionError("the core has no hands by file")
    except VtgtsamError as error:
        assert "vtgtsam[mjcf]" in str(error), error
