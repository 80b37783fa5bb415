# SPDX-License-Identifier: MIT
"""What ``print`` tells of an estimate, a recording and a hand."""

import dataclasses

import gtsam
import numpy as np
from held_box import write_grasp
from sequences import gripper

from vtgtsam import Measurement, Pad, PadSet, PoseEstimator, load_object, read_recording


def test_an_estimate_tells_pose_uncertainty_and_what_is_wrong():
    estimator = PoseEstimator(PadSet([Pad("pad", (0.02, 0.02))]), load_object("can"))
    seen = gtsam.Pose3(gtsam.Rot3.Rz(0.5), [0.1, 0.02, -0.3])
    estimate = estimator.update(Measurement(1.25, [False], T_wp=np.eye(4)[None], T_wo_visual=seen))
    estimate = dataclasses.replace(
        estimate,
        covariance=np.diag([0.01, 0.01, 0.02, 0.001, 0.001, 0.002]) ** 2,
        events=("grasped",),
        faults=("vision jumps",),
    )
    assert str(estimate).splitlines() == [
        "t = 1.250 s: ok, free",
        "  at 100.0, 20.0, -300.0 mm, sure to 2 mm",
        "  roll 0.0, pitch 0.0, yaw 28.6 degrees, sure to 1.1 degrees",
        "  the visual pose counts 100%, 0 of 1 pads hold",
        "  grasped",
        "  fault: vision jumps",
    ]
    free = np.diag([np.inf, 0.01, 0.01, 0.001, 0.001, 0.002])
    assert "one direction or more not known" in str(dataclasses.replace(estimate, covariance=free))
    assert (
        "at" not in str(dataclasses.replace(estimate, T_wo=None, status="waiting")).splitlines()[1]
    )


def test_a_recording_tells_what_it_holds(tmp_path):
    write_grasp(tmp_path / "grasp.mcap", frames=31)
    assert str(read_recording(tmp_path / "grasp.mcap")).splitlines() == [
        f"{tmp_path / 'grasp.mcap'}: hand clamp, object box, dataset vary, tracker depth",
        "  joints: 31 in 1.0 s, 30 Hz",
        "  contacts: 31 in 1.0 s, 30 Hz",
        "  hand pose: 31 in 1.0 s, 30 Hz",
        "  vision: 31 in 1.0 s, 30 Hz",
        "  truth: 31 in 1.0 s, 30 Hz",
    ]


def test_a_hand_tells_its_joints_and_pads():
    assert str(gripper()).splitlines() == [
        "hand gripper: 2 joints, 2 pads of 8.0 cm^2 in all",
        "  joints: j_left, j_right",
        "  pads: pad_left, pad_right",
    ]
