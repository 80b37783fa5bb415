# SPDX-License-Identifier: MIT
"""A robot calibrated from its recorded grasps: what is found, how sure it is, and what is refused."""

import gtsam
import numpy as np
import pytest
from gripped_boxes import CAMERA, HAND_XML, drawn, write_grip

from vtgtsam import Calibration, PoseEstimator, VtgtsamError, calibrate, read_recording
from vtgtsam.calibration.calibrate import run
from vtgtsam.exceptions import CalibrationError

ROBOT = drawn(4)
BELIEVED = np.repeat([0.01, 0.0012, np.deg2rad(1.0)], [3, 3, 4])


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("grips")
    for seed in range(4):
        write_grip(folder / f"{seed}.mcap", ROBOT, seed)
    return folder


@pytest.fixture(scope="module")
def result(folder):
    return run(folder)


def truth(robot, calibration):
    about = gtsam.Pose3(gtsam.Rot3(), calibration.camera_origin)
    moved = about.inverse().compose(robot.T_error).compose(about)
    return np.concatenate([gtsam.Pose3.Logmap(moved), robot.zeros])


def test_the_offsets_are_found_as_well_as_is_said(result):
    calibration = result.calibration
    off = calibration.offsets - truth(ROBOT, calibration)
    nees = off @ np.linalg.solve(calibration.covariance, off) / len(off)
    assert 0.1 < nees < 2.0
    sigmas = np.sqrt(np.diag(calibration.covariance))
    assert (sigmas < 1.001 * BELIEVED).all()
    assert sigmas[6:8].max() < 0.5 * BELIEVED[6]  # the fingers in whose plane the hand turned
    # The other two and the camera along the axis of the turn can shift together.
    assert any(
        all(name in sentence for name in ("camera y", "j_yp", "j_yn"))
        for sentence in calibration.unseen
    )
    assert result.left_out == {}
    assert len(result.used) == 4
    assert all(used.nees < 3 and used.residuals.contact < 2e-4 for used in result.used)
    assert result.sigma_after < result.sigma_before


def test_offsets_of_several_robots_are_as_uncertain_as_they_are_said_to_be(tmp_path):
    found = []
    for robot in (drawn(seed) for seed in range(10, 16)):
        paths = [write_grip(tmp_path / f"{seed}.mcap", robot, seed, 45) for seed in range(2)]
        calibration = calibrate(paths)
        off = calibration.offsets - truth(robot, calibration)
        found.append(off @ np.linalg.solve(calibration.covariance, off) / len(off))
    assert 0.5 < np.mean(found) < 2.0


def test_a_calibrated_estimator_is_nearer_to_the_truth(folder, result, tmp_path):
    recording = read_recording(write_grip(tmp_path / "new.mcap", ROBOT, seed=9))
    errors = []
    for calibration in (None, result.calibration):
        estimator = PoseEstimator(recording.hand, recording.object, calibration=calibration)
        frames = recording.measurements()
        estimate = [estimator.update(frame) for frame in frames][-1]
        T_true = recording.truth_at([estimate.time])[0]
        errors.append(np.linalg.norm(T_true.between(estimate.T_wo).translation()))
    assert errors[1] < 0.8 * errors[0]  # of this robot only one joint is off by more than 0.7 sigma


def test_images_that_err_alike_teach_less_of_the_camera(tmp_path):
    def camera(correlation):
        path = tmp_path / f"{correlation}" / "a.mcap"
        found = calibrate([write_grip(path, ROBOT, 0, 150, correlation=correlation)])
        return np.diag(found.covariance)[:6]

    alike, apart = camera(100.0), camera(0.0)
    assert (alike > apart).all() and alike[3:].sum() > 1.05 * apart[3:].sum(), (alike, apart)
    # A grasp is worth an image at least; the solver settles to 2 % of a standard deviation.
    np.testing.assert_allclose(alike, camera(1000.0), rtol=0.02)


def test_recordings_may_be_paths_or_read_already(folder, result):
    again = calibrate([read_recording(path) for path in sorted(folder.iterdir())])
    np.testing.assert_array_equal(again.offsets, result.calibration.offsets)


def test_a_prior_goes_on_and_knows_its_recordings(folder, result, tmp_path):
    file = tmp_path / "calibration.yaml"
    result.calibration.to_yaml(file)
    with pytest.raises(CalibrationError, match=r"0: the same as the prior"):
        calibrate(folder, prior=file)
    write_grip(tmp_path / "new" / "more.mcap", ROBOT, seed=7)
    more = run([folder, tmp_path / "new"], prior=file)
    assert [used.name for used in more.used] == ["more"]
    assert set(more.left_out) == {"0", "1", "2", "3"}
    before, after = (
        np.linalg.slogdet(c.covariance)[1] for c in (result.calibration, more.calibration)
    )
    assert after < before
    assert len(more.calibration.made_from) == 5


def test_the_same_recording_twice_counts_once(folder, tmp_path):
    (tmp_path / "copy.mcap").write_bytes((folder / "0.mcap").read_bytes())
    found = run([folder / "0.mcap", tmp_path / "copy.mcap"])
    assert found.left_out == {"copy": "the same as 0"}


def test_another_hand_is_refused(folder, tmp_path):
    other = write_grip(tmp_path / "other.mcap", hand_xml=HAND_XML.replace('"gripper"', '"tongs"'))
    with pytest.raises(CalibrationError, match="other: 0 is of hand 'gripper', not of 'tongs'"):
        calibrate([folder / "0.mcap", other])


def test_a_hand_of_the_same_name_with_other_joints_is_refused(folder, tmp_path):
    other = HAND_XML.replace('"j_yn"', '"j_last"')
    recording = read_recording(folder / "0.mcap")
    known = calibrate([recording])
    with pytest.raises(CalibrationError, match="other joints: j_last, j_yn"):
        known.check_hand(type(recording.hand).from_text(other))


def test_a_camera_that_was_moved_between_is_refused(tmp_path):
    moved = CAMERA * gtsam.Pose3(gtsam.Rot3(), np.array([0.05, 0, 0]))
    write_grip(tmp_path / "here.mcap", ROBOT, 0, 30)
    write_grip(tmp_path / "there.mcap", ROBOT, 1, 30, camera=moved)
    with pytest.raises(
        CalibrationError, match=r"there: here is of a camera 50 mm and 0 degrees away"
    ):
        calibrate(tmp_path)


def test_another_camera_at_the_same_place_is_refused(tmp_path):
    for name in "ab":
        write_grip(tmp_path / f"{name}.mcap", ROBOT, ord(name), 30, device=f"serial {name}")
    with pytest.raises(CalibrationError, match="b: a is of camera 'serial a', not of 'serial b'"):
        calibrate(tmp_path)


def test_a_wrong_mesh_is_left_out(folder, tmp_path):
    wrong = write_grip(tmp_path / "wrong.mcap", ROBOT, seed=5, mesh_scale=1.3)
    found = run([folder, wrong])
    assert set(found.left_out) == {"wrong"}
    assert "mesh" in found.left_out["wrong"]


def test_a_lost_tracker_is_left_out(folder, tmp_path):
    lost = write_grip(tmp_path / "lost.mcap", ROBOT, seed=5, lost=True)
    found = run([folder / "0.mcap", lost])
    assert "contradict touch and memory: the tracker had lost" in found.left_out["lost"]


def test_a_recording_without_contacts_is_left_out_and_alone_refused(folder, tmp_path):
    idle = ("pad_xp", "pad_xn", "pad_yp", "pad_yn", "pad_palm")
    empty = write_grip(tmp_path / "empty.mcap", ROBOT, seed=5, idle=idle)
    assert "no pad touches" in run([folder / "0.mcap", empty]).left_out["empty"]
    with pytest.raises(CalibrationError, match="no recording is of use: empty: no pad touches"):
        calibrate(empty)


def test_what_no_grasp_showed_is_said(tmp_path):
    for seed in range(2):
        write_grip(tmp_path / f"{seed}.mcap", ROBOT, seed, 45, idle=("pad_yn",))
    calibration = calibrate(tmp_path)
    (sentence,) = [sentence for sentence in calibration.unseen if sentence.startswith("j_yn")]
    assert sentence == "j_yn: nothing was learnt; grasps in which pad_yn touch would show it"
    assert calibration.joint_zeros["j_yn"] == pytest.approx(0, abs=1e-6)


def test_progress_is_told(folder):
    told = []
    run(folder / "0.mcap", progress=lambda *step: told.append(step))
    assert told == [("reading", 1, 1), ("first round", 1, 1), ("second round", 1, 1)]


def test_nothing_given_and_nothing_there_are_refused(tmp_path):
    with pytest.raises(VtgtsamError, match="no recordings given"):
        calibrate([])
    with pytest.raises(VtgtsamError, match="does not exist"):
        calibrate(tmp_path / "none")


def test_a_method_without_memory_is_refused(folder):
    from vtgtsam import EstimatorConfig

    with pytest.raises(ValueError, match="needs a method with memory, got 'vis'"):
        run(folder, config=EstimatorConfig(method="vis"))


def test_every_calibration_is_a_value(result):
    assert isinstance(result.calibration, Calibration)
    with pytest.raises(ValueError, match="read-only"):
        result.calibration.covariance[0, 0] = 1.0
