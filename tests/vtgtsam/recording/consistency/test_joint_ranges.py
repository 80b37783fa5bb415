# SPDX-License-Identifier: MIT
import numpy as np
import pytest
from sequences import HAND_XML, JOINTS, PADS, pose

from vtgtsam.recording import RecordingWriter, read_recording
from vtgtsam.recording.inspect import inspect_recording

LIMITED = HAND_XML.replace('name="j_left"', 'name="j_left" range="-30 60"')
SLIDING = HAND_XML.replace('name="j_left"', 'name="j_left" type="slide" range="0 0.04"')


@pytest.fixture
def write(tmp_path):
    def call(left, right=0.0, xml=LIMITED):
        with RecordingWriter(tmp_path / "a.mcap", {"object": "can"}, hand_xml=xml) as writer:
            for k in range(20):
                writer.joint_states(0.1 * k, JOINTS, np.array([left, right]) * k / 19)
                writer.tactile(0.1 * k, PADS, [0, 0], [0, 0])
                writer.object_pose(0.1 * k, pose(0))
        return tmp_path / "a.mcap"

    return call


def warnings(path):
    recording = read_recording(path)
    recording.measurements()
    return recording.warnings


def test_degrees_are_noticed_in_what_evaluate_warns_of_and_are_a_problem(write):
    path = write(33.6)
    said = "joint j_left goes to 33.6 rad, its range is -0.52 to 1.05: are these degrees?"
    assert warnings(path) == [said]
    assert inspect_recording(path).problems == [said]


def test_more_than_a_turn_is_noticed_without_a_range(write):
    assert "joint j_right goes to -45 rad, its range is -6.28 to 6.28" in warnings(write(0, -45))[0]


def test_of_several_joints_the_worst_is_named(write):
    assert warnings(write(33.6, 90))[0].startswith("joint j_right (and 1 more) goes to 90 rad")


def test_calibration_errors_are_no_problem_but_another_zero_is(write):
    assert warnings(write(np.deg2rad(60) + 0.29)) == []
    assert warnings(write(np.deg2rad(-30) - 0.29)) == []
    assert "goes to 1.6 rad" in warnings(write(1.6))[0]
    assert warnings(write(1.6))[0].endswith("is its zero or its sign another one?")


def test_slides_are_lengths(write):
    assert warnings(write(0.05, xml=SLIDING)) == []
    assert warnings(write(38.0, xml=SLIDING)) == [
        "joint j_left goes to 38 m, its range is 0.00 to 0.04: are these millimetres?"
    ]
