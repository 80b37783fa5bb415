# SPDX-License-Identifier: MIT
"""An estimator that goes on with another calibration."""

import dataclasses

import gtsam
import numpy as np
import pytest
from gripped_boxes import JOINTS, drawn, write_grip

from vtgtsam import Calibration, EstimatorConfig, PoseEstimator, read_recording
from vtgtsam.calibration.robot import Robot
from vtgtsam.offsets import CalibrationPrior

ROBOT = drawn(4)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return read_recording(
        write_grip(tmp_path_factory.mktemp("grip") / "a.mcap", ROBOT, seed=2, frames=75)
    )


@pytest.fixture(scope="module")
def frames(recording):
    return recording.measurements()


def calibration(recording, share=1.0, sigmas=1.0, origin=(0.0, 0.0, 0.0)):
    """A part of the true offsets, with so much of the configured uncertainty."""
    hand = recording.hand
    P = CalibrationPrior.of_config(EstimatorConfig(), hand.zero_units, np.zeros(3)).covariance
    zeros = dict(zip(JOINTS, share * ROBOT.zeros, strict=True))
    robot = Robot.of_hand(hand)
    return Calibration(robot, share * ROBOT.camera, np.array(origin), zeros, sigmas**2 * P)


def test_what_is_believed_moves_to_where_it_would_have_been(recording, frames):
    """With the same uncertainty all weights are the same, so only the offsets differ."""
    known = calibration(recording)
    always = PoseEstimator(recording.hand, recording.object, calibration=known)
    changed = PoseEstimator(recording.hand, recording.object)
    for frame in frames[:60]:
        before = changed.update(frame).T_wo
        right = always.update(frame).T_wo
    changed.recalibrate(known)
    moved = changed._belief.T_ho
    wanted = always._belief.T_ho
    was = frames[59].T_wh.between(before)
    assert right is not None
    far = np.linalg.norm(was.localCoordinates(wanted)[3:])
    assert far > 5e-4
    assert np.linalg.norm(moved.localCoordinates(wanted)[3:]) < 0.2 * far
    estimates = [(changed.update(frame), always.update(frame)) for frame in frames[60:]]
    for one, other in estimates:
        assert np.linalg.norm(one.T_wo.localCoordinates(other.T_wo)[3:]) < 0.2 * far
        assert one.mode == other.mode == "held"  # pads that are corrected do not move


def test_late_visual_poses_find_the_frames_of_before_corrected(recording, frames):
    known = calibration(recording)
    always = PoseEstimator(recording.hand, recording.object, calibration=known)
    changed = PoseEstimator(recording.hand, recording.object)
    for k, frame in enumerate(frames[3:], 3):
        if k == 60:
            changed.recalibrate(known)
        then = frames[k - 3]
        late = dataclasses.replace(frame, T_wo_visual=then.T_wo_visual, visual_time=then.time)
        one, other = changed.update(late), always.update(late)
        if k >= 60:
            assert np.linalg.norm(one.T_wo.localCoordinates(other.T_wo)[3:]) < 2e-4
    assert one.visual_weight == pytest.approx(other.visual_weight, abs=0.1)
    assert one.visual_weight > 0.5  # that of the pose that came late


def test_a_calibration_that_says_the_same_changes_nothing(recording, frames):
    nothing = calibration(recording, share=0.0)
    plain = PoseEstimator(recording.hand, recording.object)
    changed = PoseEstimator(recording.hand, recording.object)
    for k, frame in enumerate(frames):
        if k in (10, 40):
            changed.recalibrate(nothing)
        assert plain.update(frame).T_wo.equals(changed.update(frame).T_wo, 1e-9)


def test_a_tracker_that_has_stopped_is_still_named_after_the_change(recording, frames):
    estimator = PoseEstimator(recording.hand, recording.object)
    stopped = [dataclasses.replace(f, T_wo_visual=frames[20].T_wo_visual) for f in frames[20:40]]
    for frame in (*frames[:20], *stopped):
        before = estimator.update(frame)
    assert before.faults == ("vision repeats itself",)
    estimator.recalibrate(calibration(recording))
    after = estimator.update(dataclasses.replace(frames[40], T_wo_visual=frames[20].T_wo_visual))
    assert after.faults == ("vision repeats itself",)


def test_a_frozen_hand_is_still_named_after_the_change(recording, frames):
    estimator = PoseEstimator(recording.hand, recording.object)
    frozen = []
    for k in range(60):
        moved = gtsam.Pose3(gtsam.Rot3(), np.array([0.001 * k, 0.0, 0.0]))
        seen = moved.compose(frames[0].T_wo_visual)
        frozen.append(dataclasses.replace(frames[0], time=frames[k].time, T_wo_visual=seen))
    for frame in frozen[:50]:
        before = estimator.update(frame)
    assert "the hand's joints and pose are frozen" in " ".join(before.faults) or before.faults
    estimator.recalibrate(calibration(recording))
    assert estimator.update(frozen[50]).faults == before.faults


def test_a_camera_that_turns_about_another_point_is_refused(recording, frames):
    estimator = PoseEstimator(recording.hand, recording.object)
    estimator.update(frames[0])
    with pytest.raises(ValueError, match="must turn about"):
        estimator.recalibrate(calibration(recording, origin=(0.1, 0.0, 0.0)))
    with pytest.raises(ValueError, match="calibration must be a Calibration"):
        estimator.recalibrate("calibration.yaml")
