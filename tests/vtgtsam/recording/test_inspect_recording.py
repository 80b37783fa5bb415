# SPDX-License-Identifier: MIT
import gtsam
import numpy as np
import pytest
from held_box import write_grasp
from sequences import HAND_XML, JOINTS, PADS, pose, write_sequence

from vtgtsam.exceptions import RecordingError
from vtgtsam.recording import RecordingWriter, read_recording
from vtgtsam.recording.frames import evaluation_frames
from vtgtsam.recording.inspect import inspect_recording


def test_a_sound_recording_has_its_streams_and_no_problems(tmp_path):
    path = write_sequence(tmp_path / "a.mcap", metadata={"object": "can"}, hand_xml=HAND_XML)
    found = inspect_recording(path)
    assert found.problems == []
    assert found.notes == []
    assert found.frames == 90
    assert found.attachments == {"hand.xml": len(HAND_XML)}
    streams = {stream.topic: stream for stream in found.streams}
    vision = streams["/vision/object_pose"]
    assert (vision.count, vision.start) == (90, 1.0)
    assert vision.rate == pytest.approx(1 / 0.033, rel=1e-6)
    assert vision.longest_gap == pytest.approx(0.033)
    text = "\n".join(found.lines())
    assert "object: can" in text
    assert "\n  can: 66 x 66 x 101 mm\n" in text
    assert "/joint_states           300 JointState" in text
    assert text.endswith("no problems found")


def test_gaps_disorder_and_far_away_poses_are_problems(tmp_path):
    with RecordingWriter(tmp_path / "a.mcap", hand_xml=HAND_XML) as writer:
        for k in range(100):
            t = 0.01 * k + (1.0 if k >= 50 else 0.0)
            writer.joint_states(t, JOINTS, [0, 0])
            writer.tactile(t, PADS, [0, 0], [1, 0])
        for t in (0.1, 0.3, 0.2):
            writer.object_pose(t, gtsam.Pose3(gtsam.Rot3(), np.array([300.0, 0, 576.0])))
    found = inspect_recording(tmp_path / "a.mcap")
    problems = "\n".join(found.problems)
    assert "/joint_states pauses for 1.01 s, usually it comes every 10 ms" in problems
    assert "/vision/object_pose has 1 messages out of order" in problems
    assert "visual poses lie up to 649 m from the world's origin" in problems
    notes = "\n".join(found.notes)
    assert "no true poses" in notes
    assert "no camera pose" in notes
    assert "in contact in every frame: pad_left" in notes


def test_a_silent_tracker_is_a_note_with_the_frames_that_evaluate_has(tmp_path):
    path = write_grasp(tmp_path / "a.mcap", frames=40, silent=(10, 30))
    found = inspect_recording(path)
    assert found.frames == 20
    assert found.problems == []
    assert len(evaluation_frames(read_recording(path))) == 40
    (note,) = (note for note in found.notes if "evaluate has" in note)
    assert note.startswith("evaluate has 40 frames, for it goes on at the usual rate")
    assert note.endswith("20 of them are without a visual pose")


def test_what_keeps_it_from_being_evaluated_is_a_problem(tmp_path):
    with RecordingWriter(tmp_path / "a.mcap", hand_xml=HAND_XML) as writer:
        writer.joint_states(0.0, JOINTS, [0, 0])
        writer.object_pose(0.0, pose(0))
    found = inspect_recording(tmp_path / "a.mcap")
    assert found.frames is None
    assert any("has no topic /tactile/contacts" in problem for problem in found.problems)
    assert any("does not say which object it shows" in problem for problem in found.problems)
    assert found.object is None


def test_an_object_that_cannot_be_used_is_a_problem(tmp_path):
    path = write_sequence(tmp_path / "a.mcap", metadata={"object": "can"}, hand_xml=HAND_XML)
    assert inspect_recording(path, object="banana").object.startswith("banana: ")
    found = inspect_recording(path, object="spaceship")
    assert [problem.split(";")[0] for problem in found.problems] == [
        "'spaceship' is neither a mesh file nor a built-in object"
    ]


def test_an_object_too_small_to_hold_is_a_warning_that_names_the_scale(tmp_path):
    about = {"object": "can", "object_scale": "0.05"}
    found = inspect_recording(
        write_sequence(tmp_path / "a.mcap", metadata=about, hand_xml=HAND_XML)
    )
    assert found.object == "can: 3.3 x 3.3 x 5.1 mm"
    assert found.problems == []
    warning = found.warnings[-1]
    assert "very small for a hand" in warning
    assert "object_scale" in warning
    assert f"  warning: {warning}" in found.lines()


def test_a_cut_recording_says_so_once(tmp_path):
    path = write_sequence(tmp_path / "a.mcap", hand_xml=HAND_XML)
    path.write_bytes(path.read_bytes()[:-8000])
    found = inspect_recording(path)
    assert sum("cut off" in problem for problem in found.problems) == 1


def test_nothing_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="does not exist"):
        inspect_recording(tmp_path / "nothing.mcap")
