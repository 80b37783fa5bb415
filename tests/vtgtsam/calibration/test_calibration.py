# SPDX-License-Identifier: MIT
"""The calibration itself: what it corrects, and its file."""

import gtsam
import numpy as np
import pytest
from gripped_boxes import CAMERA, HAND_XML, JOINTS, PADS, drawn, write_grip
from reference import exp_se3

from vtgtsam import (
    Calibration,
    EstimatorConfig,
    HandModel,
    Measurement,
    Pad,
    PadSet,
    PoseEstimator,
    read_recording,
)
from vtgtsam.calibration.robot import Robot
from vtgtsam.exceptions import CalibrationError

ORIGIN = np.array([0.2, -0.1, 0.3])


def calibration(offsets=None, covariance=None, origin=ORIGIN, **robot):
    rng = np.random.default_rng(0)
    offsets = rng.normal(0, 0.02, 10) if offsets is None else offsets
    root = rng.normal(0, 1e-3, (10, 10))
    return Calibration(
        robot=Robot("gripper", JOINTS, **{"camera_name": "042", "T_wc": CAMERA} | robot),
        camera=offsets[:6],
        camera_origin=origin,
        joint_zeros=dict(zip(JOINTS, offsets[6:].tolist(), strict=True)),
        covariance=root @ root.T + 1e-6 * np.eye(10) if covariance is None else covariance,
        unseen=("j_xn: nothing was learnt", "größer"),
        made_from=("abc",),
    )


def test_the_file_gives_back_every_bit(tmp_path):
    before = calibration()
    before.to_yaml(tmp_path / "c.yaml")
    after = Calibration.from_yaml(tmp_path / "c.yaml")
    np.testing.assert_array_equal(after.offsets, before.offsets)
    np.testing.assert_array_equal(after.covariance, before.covariance)
    np.testing.assert_array_equal(after.camera_origin, before.camera_origin)
    assert after.joint_zeros == before.joint_zeros
    assert after.unseen == before.unseen
    assert after.made_from == before.made_from
    assert (after.hand, after.joint_names) == ("gripper", JOINTS)
    assert after.robot.camera_name == "042"
    np.testing.assert_array_equal(after.robot.T_wc.matrix(), CAMERA.matrix())
    assert after.text() == before.text()


def test_what_the_robot_believes_wrongly_is_taken_off():
    known = calibration()
    T_wo = gtsam.Pose3(exp_se3(np.random.default_rng(1).normal(0, 0.3, 6)))
    about = np.eye(4)
    about[:3, 3] = ORIGIN
    seen = about @ exp_se3(known.camera) @ np.linalg.inv(about) @ T_wo.matrix()
    joints = np.array([0.1, 0.2, 0.3, 0.4])
    raw = Measurement(1.0, np.ones(5, bool), joints + known.zeros, gtsam.Pose3(seen))
    corrected = known.corrected(raw)
    np.testing.assert_allclose(corrected.T_wo_visual.matrix(), T_wo.matrix(), atol=1e-12)
    np.testing.assert_allclose(corrected.joints, joints, atol=1e-15)
    named = dict(zip(JOINTS, (joints + known.zeros).tolist(), strict=True)) | {"wrist": 7.0}
    corrected = known.corrected(Measurement(1.0, np.ones(5, bool), named))
    assert corrected.joints["wrist"] == 7.0
    assert corrected.joints["j_yp"] == pytest.approx(0.3)
    assert corrected.T_wo_visual is None


def test_an_exact_calibration_makes_one_robot_of_another(tmp_path):
    robot = drawn(2)
    config = EstimatorConfig()
    sigmas = np.repeat([*config.camera_sigma, config.joint_sigma], [3, 3, 4])
    offsets = np.concatenate([robot.camera, robot.zeros])
    known = calibration(offsets, np.diag(sigmas**2), np.zeros(3))
    estimates = []
    for who, given in [(drawn(2), known), (None, None)]:
        kwargs = {} if who is None else {"robot": who}
        recording = read_recording(
            write_grip(tmp_path / f"{who is None}.mcap", frames=30, **kwargs)
        )
        estimator = PoseEstimator(recording.hand, recording.object, calibration=given)
        estimates.append([estimator.update(frame) for frame in recording.measurements()][-1])
    biased, unbiased = estimates
    np.testing.assert_allclose(biased.T_wo.matrix(), unbiased.T_wo.matrix(), atol=1e-6)
    np.testing.assert_allclose(biased.covariance, unbiased.covariance, rtol=1e-3, atol=1e-12)


def test_its_covariance_takes_the_place_of_the_configured_sigmas(tmp_path):
    recording = read_recording(write_grip(tmp_path / "a.mcap", frames=30))
    volumes = []
    for share in (1e-2, 1.0):
        known = calibration(np.zeros(10), share * np.diag(np.repeat([1e-4, 1e-6, 3e-4], [3, 3, 4])))
        estimator = PoseEstimator(recording.hand, recording.object, calibration=known)
        estimate = [estimator.update(frame) for frame in recording.measurements()][-1]
        volumes.append(np.linalg.slogdet(estimate.covariance)[1])
    assert volumes[0] < volumes[1] - 1


def test_the_estimator_refuses_another_hands(tmp_path):
    recording = read_recording(write_grip(tmp_path / "a.mcap", frames=10))
    tongs = HandModel.from_text(HAND_XML.replace('"gripper"', '"tongs"'))
    with pytest.raises(CalibrationError, match="is of hand 'gripper', not of 'tongs'"):
        PoseEstimator(tongs, recording.object, calibration=calibration())
    with pytest.raises(CalibrationError, match="whose joints it corrects"):
        pads = PadSet([Pad(name, (0.02, 0.02)) for name in PADS])
        PoseEstimator(pads, recording.object, calibration=calibration())
    with pytest.raises(ValueError, match="Calibration.from_yaml"):
        PoseEstimator(recording.hand, recording.object, calibration="calibration.yaml")


def test_a_recording_of_another_camera_is_refused(tmp_path):
    recording = read_recording(write_grip(tmp_path / "a.mcap", frames=10, device="043"))
    with pytest.raises(CalibrationError, match="of camera '042', not of '043'"):
        calibration().check(recording)
    calibration(camera_name="").check(recording)  # the place is the same
    calibration(camera_name="043", T_wc=None).check(recording)


def test_joints_of_another_number_and_poses_that_are_none_get_a_sentence():
    with pytest.raises(ValueError, match=r"joints must be 4 angles .* got shape \(3,\)"):
        calibration().corrected(Measurement(0.0, np.ones(5, bool), np.zeros(3)))
    with pytest.raises(ValueError, match="T_wo_visual must be a gtsam.Pose3"):
        calibration().corrected(Measurement(0.0, np.ones(5, bool), np.zeros(4), np.eye(4)))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text.replace("joint_zeros_rad:", "zeros:"), "it lacks 'joint_zeros_rad'"),
        (
            lambda text: text.replace("  j_xn:", "  j_xp2: 0.1\n  j_xn:"),
            "covariance must be finite numbers",
        ),
        (lambda text: text[: text.index("covariance:")] + "covariance: [[1, 2]]", "of shape"),
        (lambda text: "{", "is not valid YAML"),
        (lambda text: "3", "expected a mapping, got 3"),
        (lambda text: text.replace("rotation_rad: [", "rotation_rad: [.nan, "), "must be"),
    ],
)
def test_a_file_that_is_no_calibration_is_refused_by_name(tmp_path, change, words):
    file = tmp_path / "c.yaml"
    file.write_text(change(calibration().text()), encoding="utf-8")
    with pytest.raises(CalibrationError, match=words) as caught:
        Calibration.from_yaml(file)
    assert str(file) in str(caught.value)


def test_a_file_that_is_not_there_is_refused(tmp_path):
    with pytest.raises(CalibrationError, match="cannot read the calibration"):
        Calibration.from_yaml(tmp_path / "none.yaml")


def test_what_is_no_covariance_is_refused():
    with pytest.raises(ValueError, match="symmetric"):
        calibration(covariance=np.triu(np.ones((10, 10))))
    with pytest.raises(ValueError, match="positive definite"):
        calibration(covariance=np.zeros((10, 10)))
