# SPDX-License-Identifier: MIT
import gtsam
import numpy as np
import pytest
from robot_log import write_log
from sequences import HAND_XML, JOINTS, PADS, SIDE, gripper, pose, write_sequence

from vtgtsam.exceptions import HandError, MeshError, RecordingError
from vtgtsam.hands.pads import PadSet
from vtgtsam.objects import load_object
from vtgtsam.recording import RecordingWriter, messages, names, read_recording
from vtgtsam.recording.provenance import mesh_file, object_metadata


def assert_same_pose(actual, expected, atol=1e-12):
    np.testing.assert_allclose(actual.matrix(), expected.matrix(), atol=atol)


@pytest.fixture
def recording(tmp_path):
    return read_recording(write_sequence(tmp_path / "a.mcap"), hand=gripper())


def test_rate_vision_gives_a_frame_at_each_visual_pose_with_the_last_of_everything_else(recording):
    frames = recording.measurements()
    assert len(frames) == 90
    frame = frames[50]
    assert frame.time == pytest.approx(1 + 50 * 0.033, abs=1e-9)
    held = np.floor(frame.time * 100 + 1e-6) / 100
    np.testing.assert_allclose(frame.joints, [held, -held], atol=1e-12)
    assert frame.contacts.tolist() == [True, False]
    assert frames[0].contacts.tolist() == [False, False]
    assert_same_pose(frame.T_wo_visual, pose(frame.time), atol=1e-9)
    assert_same_pose(frame.T_wh, pose(held) * SIDE, atol=1e-9)
    assert frame.visual_covariance is None
    assert recording.warnings == []


def test_a_numeric_rate_gives_equally_spaced_frames_that_hold_the_visual_pose(recording):
    frames = recording.measurements(rate=20)
    np.testing.assert_allclose([f.time for f in frames], np.arange(1.0, 3.96, 0.05), atol=1e-9)
    last_seen = 1 + 0.033 * np.floor((frames[33].time - 1) / 0.033 + 1e-6)
    assert_same_pose(frames[33].T_wo_visual, pose(last_seen), atol=1e-9)


def test_rate_recorded_gives_the_instants_at_which_a_live_run_fused(tmp_path):
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        for k in range(100):
            writer.joint_states(0.01 * k, JOINTS, [k, -k])
            writer.tactile(0.01 * k, PADS, [0, 0], [0, 0])
        for t in (0.105, 0.2, 0.31):
            writer.estimate(t, pose(t))
    recording = read_recording(tmp_path / "a.mcap", hand=gripper())
    frames = recording.measurements("recorded")
    assert [f.time for f in frames] == [0.105, 0.2, 0.31]
    assert [f.joints[0] for f in frames] == [10, 20, 31]
    assert all(f.T_wo_visual is None for f in frames)
    assert [p.x() for p in recording.estimates.poses] == [0.105, 0.2, 0.31]


@pytest.mark.parametrize("rate", [0, -1, float("nan"), float("inf"), "visoin"])
def test_a_rate_that_is_none_is_refused(recording, rate):
    with pytest.raises(ValueError, match='rate must be "vision", "recorded" or a number above 0'):
        recording.measurements(rate)


def test_headers_stamps_count_and_messages_out_of_order_are_sorted(tmp_path):
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        for t in (0.2, 0.0, 0.1, 0.3):
            writer.joint_states(t, JOINTS, [t, 0])
            writer.tactile(t, PADS, [0, 0], [t == 0.1, False])
            writer.object_pose(t, pose(t))
    frames = read_recording(tmp_path / "a.mcap", hand=gripper()).measurements()
    assert [f.time for f in frames] == [0.0, 0.1, 0.2, 0.3]
    assert [f.joints[0] for f in frames] == [0.0, 0.1, 0.2, 0.3]
    assert [bool(f.contacts[0]) for f in frames] == [False, True, False, False]
    assert [f.T_wo_visual.x() for f in frames] == [0.0, 0.1, 0.2, 0.3]


def test_frames_before_the_first_sample_are_skipped_with_one_warning(tmp_path):
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        for k in range(10):
            writer.object_pose(0.1 * k, pose(k))
        writer.joint_states(0.25, JOINTS, [1, 1])
        writer.tactile(0.45, PADS, [0, 0], [1, 1])
    recording = read_recording(tmp_path / "a.mcap", hand=gripper())
    assert recording.measurements()[0].time == pytest.approx(0.5)
    recording.measurements()
    (warning,) = recording.warnings
    assert warning.startswith("5 of 10 frames are skipped")


def test_a_joint_published_by_somebody_else_is_merged_by_name(tmp_path):
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        for k in range(10):
            writer.joint_states(0.1 * k, ["j_left", "wrist"], [k, 77])
            writer.joint_states(0.1 * k + 0.05, ["j_right"], [-k])
            writer.tactile(0.1 * k, ["pad_right", "pad_left"], [0, 0], [False, True])
            writer.object_pose(0.1 * k + 0.07, pose(k))
    frames = read_recording(tmp_path / "a.mcap", hand=gripper()).measurements()
    np.testing.assert_array_equal([f.joints for f in frames], [[k, -k] for k in range(10)])
    assert all(f.contacts.tolist() == [True, False] for f in frames)


def test_a_visual_pose_counts_for_a_second_and_no_longer(tmp_path):
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        for k in range(31):
            writer.joint_states(0.1 * k, JOINTS, [0, 0])
            writer.tactile(0.1 * k, PADS, [0, 0], [0, 0])
        writer.object_pose(0.5, pose(0))
        writer.object_pose(2.5, pose(1))
    frames = read_recording(tmp_path / "a.mcap", hand=gripper()).measurements(10)
    seen = [f.T_wo_visual is not None for f in frames]
    assert seen == [False] * 5 + [True] * 11 + [False] * 9 + [True] * 6


def test_joints_that_stop_are_held_with_a_warning(tmp_path):
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        writer.joint_states(0.0, JOINTS, [0, 0])
        for k in range(31):
            writer.tactile(0.1 * k, PADS, [0, 0], [0, 0])
            writer.object_pose(0.1 * k, pose(k))
    recording = read_recording(tmp_path / "a.mcap", hand=gripper())
    assert len(recording.measurements()) == 31
    (warning,) = recording.warnings
    assert warning.startswith(
        "20 of 31 frames use joint angles that are more than 1 s old, up to 3.0 s"
    )


def test_a_hand_that_never_moves_needs_one_pose_and_one_without_pose_stands_at_the_origin(tmp_path):
    for name, poses in (("none.mcap", []), ("one.mcap", [pose(0.7)])):
        with RecordingWriter(tmp_path / name) as writer:
            for k in range(3):
                writer.joint_states(0.1 * k, JOINTS, [0, 0])
                writer.tactile(0.1 * k, PADS, [0, 0], [0, 0])
                writer.object_pose(0.1 * k, pose(k))
            for T_wh in poses:
                writer.hand_pose(0.2, T_wh)
        frames = read_recording(tmp_path / name, hand=gripper()).measurements()
        assert len(frames) == 3
        assert_same_pose(frames[0].T_wh, poses[0] if poses else gtsam.Pose3())


def test_visual_poses_keep_their_covariance_where_they_have_one(tmp_path):
    covariance = np.diag([1e-4, 4e-4, 1e-4, 9e-6, 4e-6, 9e-6])
    covariance[0, 4] = covariance[4, 0] = 1e-5
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        writer.joint_states(0.0, JOINTS, [0, 0])
        writer.tactile(0.0, PADS, [0, 0], [0, 0])
        writer.object_pose(0.1, pose(0), covariance)
        writer.object_pose(0.2, pose(0))
    first, second = read_recording(tmp_path / "a.mcap", hand=gripper()).measurements()
    np.testing.assert_allclose(first.visual_covariance, covariance, atol=1e-15)
    assert second.visual_covariance is None


def write_raw(path, topic, msgtype, fields):
    """Write messages that RecordingWriter refuses; each of ``fields`` is (stamp [s], fields)."""
    with RecordingWriter(path) as writer:
        for k in range(5):
            writer.joint_states(0.1 * k, JOINTS, [0, 0])
            writer.tactile(0.1 * k, PADS, [0, 0], [0, 0])
        for stamp, content in fields:
            writer._write(topic, msgtype, stamp, "world", content)


def fields_of(position, orientation):
    names_xyzw = dict(zip("xyzw", orientation, strict=True))
    return {
        "pose": {"position": dict(zip("xyz", position, strict=True)), "orientation": names_xyzw}
    }


def test_poses_that_are_none_are_left_out_with_a_warning(tmp_path):
    good = fields_of([1, 2, 3], [0, 0, 0, 1])
    write_raw(
        tmp_path / "a.mcap",
        names.VISION,
        messages.POSE,
        [
            (0.0, good),
            (0.1, fields_of([np.nan, 2, 3], [0, 0, 0, 1])),
            (0.2, fields_of([1, 2, 3], [0, 0, 0, 0])),
            (0.3, fields_of([1, 2, 3], [0, 0, 0, 2])),
            (0.4, fields_of([1, 2, 3], [0, 0, 0, 1.001])),
        ],
    )
    recording = read_recording(tmp_path / "a.mcap", hand=gripper())
    assert [f.time for f in recording.measurements()] == [0.0, 0.4]
    assert recording.warnings == [
        "topic /vision/object_pose: 3 of 5 messages are left out, "
        "they are not finite or have a quaternion whose norm is not 1"
    ]


def test_a_topic_with_no_usable_pose_is_refused_when_it_is_needed(tmp_path):
    broken = [(0.1 * k, fields_of([0, 0, 0], [0, 0, 0, 0])) for k in range(3)]
    write_raw(tmp_path / "a.mcap", names.VISION, messages.POSE, broken)
    recording = read_recording(tmp_path / "a.mcap", hand=gripper())
    with pytest.raises(RecordingError, match="/vision/object_pose holds no usable message"):
        recording.measurements()


def test_joint_angles_that_are_not_finite_cost_their_joint_that_sample(tmp_path):
    bad = (0.35, {"name": list(JOINTS), "position": [np.nan, 5.0]})
    write_raw(tmp_path / "a.mcap", names.JOINTS, messages.JOINT_STATE, [bad])
    recording = read_recording(tmp_path / "a.mcap", hand=gripper())
    assert recording.warnings == [
        "topic /joint_states: 1 of 6 values of j_left are left out, they are not finite"
    ]
    assert all(np.isfinite(f.joints).all() for f in recording.measurements(20))
    assert recording.measurements(20)[7].joints.tolist() == [0.0, 5.0]


def test_streams_of_different_clocks_are_refused(tmp_path):
    for name, joints_start, vision_start in (("later", 1.7e9, 0.0), ("earlier", 0.0, 1.7e9)):
        with RecordingWriter(tmp_path / name) as writer:
            for k in range(10):
                writer.joint_states(joints_start + 0.1 * k, JOINTS, [0, 0])
                writer.tactile(joints_start + 0.1 * k, PADS, [0, 0], [0, 0])
                writer.object_pose(vision_start + 0.1 * k, pose(0))
        recording = read_recording(tmp_path / name, hand=gripper())
        with pytest.raises(
            RecordingError, match="no frame has joints, .* are the stamps of one clock"
        ):
            recording.measurements()


def test_a_message_that_nobody_stamped_is_left_out_and_a_wild_stamp_makes_no_frames(tmp_path):
    def write(path, wild):
        with RecordingWriter(path) as writer:
            for t in (wild, 1.7e9, 1.7e9 + 0.1, 1.7e9 + 0.2):
                writer.joint_states(t, JOINTS, [t, 0])
                writer.tactile(t, PADS, [0, 0], [0, 0])

    write(tmp_path / "zero", 0.0)
    recording = read_recording(tmp_path / "zero", hand=gripper())
    assert len(recording.measurements(10)) == 3
    assert "1 of 4 messages are left out, they have no stamp" in recording.warnings[0]
    write(tmp_path / "wild", 1.0)
    recording = read_recording(tmp_path / "wild", hand=gripper())
    assert 3 <= len(recording.measurements(10)) <= 4
    assert any("is a stamp wrong" in warning for warning in recording.warnings)


def test_a_message_without_positions_costs_itself(tmp_path):
    bad = (0.5, {"name": ["j_left"], "position": []})
    write_raw(tmp_path / "a.mcap", names.JOINTS, messages.JOINT_STATE, [bad])
    recording = read_recording(tmp_path / "a.mcap", hand=gripper())
    assert recording.warnings == [
        "topic /joint_states: 1 of 6 messages are left out, they have no value for each of their names"
    ]
    assert len(recording.measurements(10)) == 5


def test_as_many_positions_as_names_are_needed(tmp_path):
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        fields = {"name": ["j_left", "j_right"], "position": [1.0]}
        writer._write(names.JOINTS, messages.JOINT_STATE, 0.5, "", fields)
    with pytest.raises(RecordingError, match="has 1 values for the 2 names j_left, j_right"):
        read_recording(tmp_path / "a.mcap")


def test_of_two_messages_with_one_stamp_the_last_counts(tmp_path):
    fields = [(0.2, fields_of([x, 0, 0], [0, 0, 0, 1])) for x in (1, 2)]
    write_raw(tmp_path / "a.mcap", names.VISION, messages.POSE, fields)
    recording = read_recording(tmp_path / "a.mcap", hand=gripper())
    (frame,) = recording.measurements()
    assert frame.T_wo_visual.x() == 2
    assert "1 of 2 messages are left out, they have another one's stamp" in recording.warnings[0]


def test_missing_streams_are_named_together_with_what_there_is(tmp_path):
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        writer.joint_states(0.0, JOINTS, [0, 0])
        writer.truth(0.0, pose(0))
    recording = read_recording(tmp_path / "a.mcap", hand=gripper())
    with pytest.raises(RecordingError) as error:
        recording.measurements()
    text = str(error.value)
    assert "has no topic /tactile/contacts (contacts)" in text
    assert "/joint_states (sensor_msgs/msg/JointState)" in text
    assert "\n" not in text


def test_a_tracker_that_never_had_a_pose_is_said_to_be_one(tmp_path):
    path = tmp_path / "a.mcap"
    with RecordingWriter(path, {"tracker": "depth"}) as writer:
        writer.joint_states(0.0, JOINTS, [0, 0])
        writer.tactile(0.0, PADS, [0, 0], [0, 0])
    with pytest.raises(
        RecordingError, match=r"its tracker \(depth\) never had a pose.*attach-vision"
    ):
        read_recording(path, hand=gripper()).measurements()


def test_missing_joints_and_pads_are_listed(tmp_path):
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        writer.joint_states(0.0, ["j_left", "other"], [0, 0])
        writer.tactile(0.0, PADS, [0, 0], [0, 0])
        writer.object_pose(0.0, pose(0))
    recording = read_recording(tmp_path / "a.mcap", hand=gripper())
    with pytest.raises(
        RecordingError, match="lacks the hand's joints j_right; it has j_left, other"
    ):
        recording.measurements()


def test_truth_is_interpolated_between_its_stamps_and_nowhere_else(recording):
    times, poses = recording.ground_truth
    assert len(times) == len(poses) == 300
    inside, exact, before, after = recording.truth_at([2.005, 2.01, 0.5, 9.0])
    assert_same_pose(inside, pose(2.005))
    assert_same_pose(exact, pose(2.01))
    assert before is None and after is None


def test_one_instant_has_one_true_pose(recording):
    assert_same_pose(recording.truth_at(2.005), pose(2.005))
    assert recording.truth_at(np.float64(9.0)) is None
    assert recording.truth_at(float("nan")) is None
    assert len(recording.truth_at(recording.ground_truth.times)) == 300
    for wrong in ("soon", None, [[2.0]], gtsam.Pose3()):
        with pytest.raises(ValueError, match="instants .s. must be a number or a sequence of num"):
            recording.truth_at(wrong)


def test_truth_rotates_the_shorter_way_and_is_unknown_in_a_gap(tmp_path):
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        writer.truth(0.0, gtsam.Pose3(gtsam.Rot3.Rz(3.1), np.zeros(3)))
        writer.truth(0.4, gtsam.Pose3(gtsam.Rot3.Rz(-3.1), np.zeros(3)))
        writer.truth(1.0, gtsam.Pose3())
    middle, gap = read_recording(tmp_path / "a.mcap").truth_at([0.2, 0.7])
    assert_same_pose(middle, gtsam.Pose3(gtsam.Rot3.Rz(np.pi), np.zeros(3)), atol=1e-9)
    assert gap is None


def test_without_truth_asking_for_it_is_an_error_and_the_property_is_none(tmp_path):
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        writer.joint_states(0.0, JOINTS, [0, 0])
    recording = read_recording(tmp_path / "a.mcap")
    assert recording.ground_truth is None
    with pytest.raises(RecordingError, match="has no topic /truth/object_pose"):
        recording.truth_at([0.0])


def test_the_camera_is_where_it_was_last_seen(tmp_path):
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        writer.camera_pose(1.0, pose(1.0))
        writer.camera_pose(2.0, pose(2.0))
    recording = read_recording(tmp_path / "a.mcap")
    assert_same_pose(recording.camera_pose, pose(1.0))
    assert recording.camera_pose_at(0.5) is None
    assert recording.camera_pose_at(1.5).x() == 1.0
    assert recording.camera_pose_at(2.5).x() == 2.0


def test_a_recording_with_its_hand_and_object_attached_needs_nothing_else(tmp_path):
    ball = load_object("ball")
    path = write_sequence(
        tmp_path / "a.mcap", metadata=object_metadata(ball), hand_xml=HAND_XML, mesh=mesh_file(ball)
    )
    recording = read_recording(path)
    assert recording.hand.pad_names == PADS
    found = recording.object
    assert (found.name, found.sha256, found.symmetry) == ("ball", ball.sha256, ball.symmetry)
    np.testing.assert_array_equal(found.mesh.vertices, ball.mesh.vertices)
    np.testing.assert_array_equal(found.sdf.values, ball.sdf.values)


def test_an_attached_mesh_is_in_its_own_unit_and_frame(tmp_path):
    shifted = load_object("ball", scale=0.5, origin=(0.01, 0.02, -0.03))
    path = write_sequence(
        tmp_path / "a.mcap", metadata=object_metadata(shifted), mesh=mesh_file(shifted)
    )
    found = read_recording(path).object
    np.testing.assert_array_equal(found.mesh.vertices, shifted.mesh.vertices)
    assert found.sha256 == load_object("ball").sha256


def test_another_mesh_than_that_of_the_recording_is_noticed(tmp_path):
    ball = load_object("ball")
    path = write_sequence(tmp_path / "a.mcap", metadata=object_metadata(ball), mesh=mesh_file(ball))
    same, other = read_recording(path), read_recording(path, object="golf_ball")
    assert (same.object.name, other.object.name) == ("ball", "golf_ball")
    assert same.warnings == []
    assert other.warnings == ["the recording was made with another mesh of 'ball'"]


def test_arguments_go_before_attachments_and_attachments_before_names(tmp_path):
    path = write_sequence(tmp_path / "a.mcap", metadata={"hand": "isyhand", "object": "ball"})
    assert len(read_recording(path).hand.pad_names) == 16
    assert read_recording(path, hand=gripper()).hand.pad_names == PADS
    assert read_recording(path).object.name == "ball"
    assert read_recording(path, object="can").object.name == "can"
    attached = write_sequence(tmp_path / "b.mcap", metadata={"hand": "isyhand"}, hand_xml=HAND_XML)
    assert read_recording(attached).hand.pad_names == PADS


def test_a_recording_that_does_not_say_its_hand_or_object_says_what_to_give(tmp_path):
    recording = read_recording(write_sequence(tmp_path / "a.mcap"))
    with pytest.raises(RecordingError, match="which hand it was made with; give hand="):
        _ = recording.hand
    with pytest.raises(RecordingError, match="which object it shows; give object="):
        _ = recording.object
    with pytest.raises(HandError, match="unknown hand 'nohand'"):
        _ = read_recording(tmp_path / "a.mcap", hand="nohand").hand


def test_a_hand_without_joints_is_refused(tmp_path):
    path = write_sequence(tmp_path / "a.mcap")
    with pytest.raises(RecordingError, match="has no joints, and a recording has no pad poses"):
        read_recording(path, hand=PadSet(gripper().pads)).measurements()


def test_what_is_no_path_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="a recording is given by its path, got NoneType"):
        read_recording(None)
    with pytest.raises(RecordingError, match="topics must be a TopicMap or the path .* got dict"):
        read_recording(tmp_path, topics={"joints": "/a"})


def test_a_path_without_a_recording_is_refused(tmp_path):
    with pytest.raises(RecordingError, match="does not exist"):
        read_recording(tmp_path / "nothing.mcap")
    with pytest.raises(
        RecordingError, match=r"holds neither an \.mcap file nor a rosbag2 metadata\.yaml"
    ):
        read_recording(tmp_path)


def test_an_object_that_cannot_be_had_is_tried_once(tmp_path, monkeypatch):
    tried = []

    def refuse(*_):
        tried.append(1)
        raise MeshError("the mesh is open")

    monkeypatch.setattr("vtgtsam.recording.reader.find_object", refuse)
    recording = read_recording(write_log(tmp_path / "log.mcap"))
    for _ in range(2):
        with pytest.raises(MeshError, match="the mesh is open"):
            _ = recording.object
    assert recording.findings is not None and len(tried) == 1
