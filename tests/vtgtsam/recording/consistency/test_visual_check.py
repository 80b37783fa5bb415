# SPDX-License-Identifier: MIT
import contextlib

import gtsam
import numpy as np
import pytest
from held_box import write_grasp
from sequences import pose

from vtgtsam import cli, load_object, read_recording
from vtgtsam.recording.consistency.vision import visual_off_truth
from vtgtsam.recording.inspect import inspect_recording
from vtgtsam.recording.trajectory import PoseTrajectory

TIMES = np.arange(10) * 0.1
TRUE = [pose(0.01 * k) for k in range(10)]


def said(visual):
    can = load_object("can")
    return visual_off_truth(PoseTrajectory(TIMES, visual), PoseTrajectory(TIMES, TRUE), can)


def test_poses_6_cm_off_are_noticed_and_4_cm_are_the_trackers_own_error():
    (sentence,) = said([gtsam.Pose3(T.rotation(), T.translation() + [0.06, 0, 0]) for T in TRUE])
    assert "off the true ones by 60 mm and 0 degrees" in sentence
    assert "'frame: camera' or 'world'" in sentence
    assert "qx qy qz qw" in sentence
    assert said([gtsam.Pose3(T.rotation(), T.translation() + [0.04, 0, 0]) for T in TRUE]) == []


def test_a_turn_about_the_axis_of_symmetry_is_no_error():
    turned = gtsam.Pose3(gtsam.Rot3.Rz(2.0), np.zeros(3))
    assert said([T * turned for T in TRUE]) == []
    (sentence,) = said([gtsam.Pose3(gtsam.Rot3(), [0.1, 0, 0]) * T * turned for T in TRUE])
    assert "100 mm and 0 degrees" in sentence


def test_most_poses_count_and_none_is_no_error():
    lost = [pose(3.0)] * 4
    assert said([*lost, *TRUE[4:]]) == []
    assert visual_off_truth(None, PoseTrajectory(TIMES, TRUE), load_object("can")) == []


@pytest.fixture
def wrong_frame(tmp_path):
    """A recording, and a map that takes its world poses for poses in the camera frame."""
    (tmp_path / "map.yaml").write_text(
        "topics: {joints: /joint_states, contacts: /tactile/contacts, camera_pose: /camera/pose, "
        "vision: {topic: /vision/object_pose, frame: camera}}"
    )
    return write_grasp(tmp_path / "a.mcap", frames=6), tmp_path / "map.yaml"


def test_a_wrong_frame_is_in_the_recordings_warnings(wrong_frame):
    path, topics = wrong_frame
    recording = read_recording(path, topics=topics)
    recording.measurements()
    assert any("visual poses are off the true ones" in text for text in recording.warnings)


def test_inspect_warns_of_a_wrong_frame_and_calls_it_no_problem(wrong_frame):
    path, topics = wrong_frame
    found = inspect_recording(path, topics=topics)
    assert "visual poses are off the true ones" in found.warnings[0]
    assert len(found.warnings) == 1
    assert found.problems == []
    assert inspect_recording(path).warnings == []


def test_evaluate_prints_it(wrong_frame, tmp_path, monkeypatch, capsys):
    path, topics = wrong_frame
    arguments = [path, "--out", tmp_path / "out", "--topics", topics]
    monkeypatch.setattr("sys.argv", ["vtgtsam", "evaluate", *map(str, arguments)])
    with contextlib.suppress(SystemExit):
        cli.main()
    assert "visual poses are off the true ones" in " ".join(capsys.readouterr().out.split())
