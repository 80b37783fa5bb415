# SPDX-License-Identifier: MIT
"""Recordings as another robot would have made them."""

import gtsam
import numpy as np
import pytest
from gripped_boxes import write_grip

from benchmarks.imposed import as_robot, misled, robot_error, true_offsets
from vtgtsam import read_recording
from vtgtsam.exceptions import RecordingError


@pytest.fixture
def recording(tmp_path):
    recording = read_recording(write_grip(tmp_path / "grip.mcap", frames=6))
    recording.info["calibration_error"] = "no"
    return recording


def test_camera_and_joints_are_off_as_the_robots_are(recording):
    error = robot_error(5000, 4)
    before, after = (each.measurements() for each in (recording, as_robot(recording, 5000)))
    for plain, spoilt in zip(before, after, strict=True):
        np.testing.assert_allclose(spoilt.joints, plain.joints + error.joints, atol=1e-12)
        seen = error.T_error.compose(plain.T_wo_visual)
        np.testing.assert_allclose(spoilt.T_wo_visual.matrix(), seen.matrix(), atol=1e-12)
    moved = error.T_error.compose(recording.camera_pose)
    assert as_robot(recording, 5000).camera_pose.equals(moved, 1e-12)


def test_a_robots_own_error_is_taken_off_first(recording):
    twice = as_robot(as_robot(recording, 5000), 5001).measurements()
    once = as_robot(recording, 5001).measurements()
    for a, b in zip(twice, once, strict=True):
        np.testing.assert_allclose(a.joints, b.joints, atol=1e-12)
        assert a.T_wo_visual.equals(b.T_wo_visual, 1e-12)


def test_the_true_offsets_are_those_of_a_calibration_about_any_point():
    origin = np.array([0.3, -0.2, 0.5])
    error, offsets = robot_error(5000, 4), true_offsets(5000, 4, origin)
    about = gtsam.Pose3(gtsam.Rot3(), origin)
    moved = about * gtsam.Pose3.Expmap(offsets[:6]) * about.inverse()
    assert moved.equals(error.T_error, 1e-12)
    np.testing.assert_array_equal(offsets[6:], error.joints)


def test_a_tracker_that_knows_the_hand_is_refused(recording):
    recording.info["tracker"] = "depth-hand"
    with pytest.raises(RecordingError, match="expected tracker 'depth', got 'depth-hand'"):
        as_robot(recording, 5000)


def test_a_tracker_that_is_off_is_so_by_as_much_and_alike_on_the_object(recording):
    off = [
        plain.T_wo_visual.between(wrong.T_wo_visual)
        for plain, wrong in zip(
            recording.measurements(), misled(recording, 0.003).measurements(), strict=True
        )
    ]
    assert np.linalg.norm(off[0].translation()) == pytest.approx(0.003)
    assert all(each.equals(off[0], 1e-9) for each in off)
    assert off[0].rotation().equals(gtsam.Rot3(), 1e-9)
