# SPDX-License-Identifier: MIT
"""A robot that calibrates itself while it works."""

import dataclasses
import time

import gtsam
import numpy as np
import pytest
from gripped_boxes import drawn, write_grip

from vtgtsam import Calibration, EstimatorConfig, Pad, PadSet, PoseEstimator, read_recording
from vtgtsam.calibration.background import Background
from vtgtsam.calibration.keyframes import grasp
from vtgtsam.calibration.one_grasp import Question, answer_to
from vtgtsam.calibration.online import OnlineCalibration
from vtgtsam.calibration.posterior import Known
from vtgtsam.calibration.robot import Robot
from vtgtsam.exceptions import CalibrationError

ROBOT = drawn(4)


@pytest.fixture(scope="module")
def recording(tmp_path_factory):
    return read_recording(
        write_grip(tmp_path_factory.mktemp("grip") / "a.mcap", ROBOT, seed=2, frames=150)
    )


@pytest.fixture(scope="module")
def frames(recording):
    return recording.measurements()


def online(recording, **options):
    return OnlineCalibration(recording.hand, recording.object, background=False, **options)


def error(recording, estimate):
    return np.linalg.norm(recording.truth_at(estimate.time).between(estimate.T_wo).translation())


def test_a_robot_that_knows_nothing_of_itself_is_nearer_to_the_truth_within_its_first_grasp(
    recording, frames
):
    plain = PoseEstimator(recording.hand, recording.object)
    calibrating = online(recording)
    assert calibrating.calibration is None
    without = [error(recording, plain.update(frame)) for frame in frames]
    with_it = [error(recording, calibrating.update(frame)) for frame in frames]
    assert with_it[:30] == without[:30]  # nothing is known yet
    assert np.median(with_it[-40:]) < 0.85 * np.median(without[-40:])
    assert isinstance(calibrating.calibration, Calibration)


def test_each_change_is_told_with_the_frame_from_which_on_it_holds_and_gives_the_same_poses_again(
    recording, frames
):
    told = []
    first = online(recording, on_change=lambda *change: told.append(change))
    estimates = [first.update(frame) for frame in frames]
    assert [at for at, _ in told] == pytest.approx(
        [frames[k].time for k in (31, 61, 91, 121)], abs=0.07
    )
    again = PoseEstimator(recording.hand, recording.object)
    changes = dict(told)
    for frame, estimate in zip(frames, estimates, strict=True):
        if frame.time in changes:
            again.recalibrate(changes[frame.time])
        assert again.update(frame).T_wo.equals(estimate.T_wo, 0.0)


def test_what_a_grasp_has_shown_stays_known_after_a_reset(recording, frames):
    calibrating = online(recording)
    for frame in frames:
        calibrating.update(frame)
    learnt = calibrating.calibration
    calibrating.reset()
    estimate = calibrating.update(frames[0])
    assert calibrating.calibration is learnt
    fresh = PoseEstimator(recording.hand, recording.object, calibration=learnt)
    assert fresh.update(frames[0]).T_wo.equals(estimate.T_wo, 0.0)
    for frame in frames[1:]:
        calibrating.update(frame)
    sure = [np.linalg.slogdet(c.covariance)[1] for c in (learnt, calibrating.calibration)]
    assert sure[1] < sure[0]


def test_at_the_end_the_whole_grasp_counts_and_nobody_is_told(recording, frames):
    told = []
    calibrating = online(recording, period=100.0, on_change=lambda *change: told.append(change))
    for frame in frames:
        calibrating.update(frame)
    assert not calibrating.learnt
    calibrating.finish()
    assert calibrating.learnt and not told
    before = np.diag(
        Known.before(
            Robot.of_hand(recording.hand), recording.hand, frames[0], None, EstimatorConfig()
        ).belief.covariance
    )
    assert (np.diag(calibrating.calibration.covariance) < before).all()


def test_a_grasp_of_something_else_changes_nothing(tmp_path):
    wrong = read_recording(
        write_grip(tmp_path / "wrong.mcap", ROBOT, seed=2, frames=150, mesh_scale=1.3)
    )
    calibrating = online(wrong)
    for frame in wrong.measurements():
        calibrating.update(frame)
    assert calibrating.calibration is None


def test_a_tracker_that_gets_lost_takes_back_what_it_had_changed(recording, frames):
    told = []
    calibrating = online(recording, on_change=lambda *change: told.append(change[1]))
    away = gtsam.Pose3(gtsam.Rot3(), np.array([0.0, 0.05, 0.0]))
    for frame in frames[:60]:
        calibrating.update(frame)
    assert np.abs(told[-1].offsets).max() > 1e-4
    for frame in frames[60:]:
        seen = dataclasses.replace(frame, T_wo_visual=frame.T_wo_visual.compose(away))
        calibrating.update(seen)
    np.testing.assert_array_equal(told[-1].offsets, np.zeros(10))


def test_a_visual_pose_that_comes_late_calibrates_as_one_in_time(recording, frames):
    late = 3  # frames
    calibrating = online(recording)
    for k in range(late, len(frames)):
        then = frames[k - late]
        calibrating.update(
            dataclasses.replace(frames[k], T_wo_visual=then.T_wo_visual, visual_time=then.time)
        )
    in_time = online(recording)
    for frame in frames[: len(frames) - late]:
        in_time.update(frame)
    sigmas = np.sqrt(np.diag(in_time.calibration.covariance))
    off = calibrating.calibration.offsets - in_time.calibration.offsets
    # Other frames are keyframes. In three frames the hand turns by 2.7 degrees: five of the camera's sigmas.
    assert (np.abs(off) < sigmas).all()


def test_a_process_in_the_background_gives_the_same_answer(recording, frames):
    hand, obj = recording.hand, recording.object
    config = EstimatorConfig()
    known = Known.before(Robot.of_hand(hand), hand, frames[0], None, config)
    seen = grasp("g", PoseEstimator(hand, obj), frames[:60])
    question = Question(7, seen, known.belief, known.belief.mean, known.camera_origin, config)
    background = Background(hand, obj)
    try:
        background.ask(question)
        assert background.busy
        end = time.monotonic() + 120
        while (answer := background.answer()) is None and time.monotonic() < end:
            time.sleep(0.02)
        assert answer is not None and not background.busy
    finally:
        background.close()
    here = answer_to(question)
    assert answer.number == 7 and answer.refused == here.refused == ""
    np.testing.assert_array_equal(answer.belief.mean, here.belief.mean)
    assert answer.poses.keys() == here.poses.keys()


def test_a_background_that_dies_leaves_the_poses_as_they_are(recording, frames, caplog):
    with OnlineCalibration(recording.hand, recording.object, period=0.1) as calibrating:
        calibrating._background._process.kill()
        calibrating._background._process.wait()
        estimates = [calibrating.update(frame) for frame in frames[:60]]
        calibrating._background._thread.join(10)
    assert "the process that calibrates has ended" in caplog.text
    plain = PoseEstimator(recording.hand, recording.object)
    for frame, estimate in zip(frames[:60], estimates, strict=True):
        assert plain.update(frame).T_wo.equals(estimate.T_wo, 0.0)


def test_a_hand_without_joints_and_a_method_without_memory_are_refused(recording):
    with pytest.raises(CalibrationError, match="corrects joints"):
        OnlineCalibration(PadSet([Pad("a", (0.01, 0.01))]), recording.object)
    with pytest.raises(ValueError, match="needs a method with memory, got 'vis'"):
        OnlineCalibration(recording.hand, recording.object, EstimatorConfig(method="vis"))
