# SPDX-License-Identifier: MIT
"""Bags written by the rosbags library under other people's topic names, read through a map."""

import sqlite3

import numpy as np
import pytest
from foreign_bags import MAP, T_WC, WRITERS, Bag, fill, store, write_ros2
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from sequences import HAND_XML, pose

from vtgtsam.exceptions import RecordingError
from vtgtsam.recording import load_topics, read_recording


@pytest.fixture
def topic_map(tmp_path):
    (tmp_path / "hand.xml").write_text(HAND_XML)
    (tmp_path / "map.yaml").write_text(MAP)
    return tmp_path / "map.yaml"


@pytest.mark.parametrize("kind", WRITERS)
def test_a_bag_of_any_kind_reads_the_same_through_the_map(tmp_path, topic_map, kind):
    recording = read_recording(WRITERS[kind](tmp_path / "bag"), topics=topic_map)
    frames = recording.measurements()
    assert [f.time for f in frames] == pytest.approx([0.033 * k for k in range(28)], abs=1e-9)
    for frame in frames:
        np.testing.assert_allclose(frame.T_wo_visual.matrix(), pose(frame.time).matrix(), atol=1e-9)
        held = np.floor(frame.time * 100 + 1e-6) / 100
        np.testing.assert_allclose(frame.joints, [held, -held], atol=1e-12)
        # The second pad's value is the threshold itself, which is a contact.
        assert frame.contacts.tolist() == [frame.time >= 0.5, True]
    assert recording.hand.name == "gripper"
    assert recording.object.name == "ball"
    assert recording.truth_at([0.25])[0].x() == pytest.approx(0.25)
    # The pad's touch is made up: at the true pose it is 8 mm away, and that is told.
    assert [w for w in recording.warnings if "touches while it is 8 mm" not in w] == []


def test_a_sqlite_bag_of_an_old_ros_without_definitions_is_read_too(tmp_path, topic_map):
    with Writer2(tmp_path / "bag", version=8, storage_plugin=StoragePlugin.SQLITE3) as writer:
        fill(Bag(writer, store(), 2))
    (database,) = (tmp_path / "bag").glob("*.db3")
    with sqlite3.connect(database) as connection:
        assert connection.execute("DELETE FROM message_definitions").rowcount > 0
    assert len(read_recording(tmp_path / "bag", topics=topic_map).measurements()) == 28


def test_a_rosbag2_folder_that_a_crash_left_without_metadata_is_read(tmp_path, topic_map):
    path = write_ros2(tmp_path / "bag", StoragePlugin.MCAP)
    (path / "metadata.yaml").unlink()
    (file,) = path.glob("*.mcap")
    file.write_bytes(file.read_bytes()[:-400])
    recording = read_recording(path, topics=topic_map)
    assert len(recording.measurements()) == 28
    told = [w for w in recording.warnings if "touches while it is 8 mm" not in w]
    assert len(told) == 1


def test_a_damaged_sqlite_bag_says_so(tmp_path, topic_map):
    path = write_ros2(tmp_path / "bag", StoragePlugin.SQLITE3)
    (database,) = path.glob("*.db3")
    content = database.read_bytes()
    database.write_bytes(content[: len(content) // 2])
    try:
        recording = read_recording(path, topics=topic_map)
    except RecordingError as error:
        assert "\n" not in str(error) and str(path) in str(error)
        assert "copy it again; ROS bags in MCAP" in str(error)
    else:
        assert any("is damaged" in warning for warning in recording.warnings)


def write_map(tmp_path, text):
    (tmp_path / "map.yaml").write_text(text)
    return tmp_path / "map.yaml"


def test_an_array_needs_names_and_a_threshold_in_the_map(tmp_path, topic_map):
    path = write_ros2(tmp_path / "bag", StoragePlugin.MCAP)
    text = topic_map.read_text()
    nameless = write_map(tmp_path, text.replace("names: [pad_left, pad_right], ", ""))
    with pytest.raises(RecordingError, match="which names no pads; give the pads' names"):
        read_recording(path, topics=nameless)
    without = write_map(tmp_path, text.replace(", threshold: 0.15", ""))
    with pytest.raises(RecordingError, match="say in the topic map from which value on"):
        read_recording(path, topics=without)
    three = write_map(tmp_path, text.replace("[pad_left, pad_right]", "[a, b, c]"))
    with pytest.raises(RecordingError, match="has 2 values for the 3 names a, b, c"):
        read_recording(path, topics=three)


def test_bytes_are_contacts_from_one_on_and_receive_times_count(tmp_path):
    with Writer2(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        bag = Bag(writer, store(), 2)
        for k in range(10):
            bag.joints("/joint_states", 0.1 * k, ["j_left", "j_right"], [0, 0])
            bag.array("/skin", 0.1 * k, [k >= 5, 0], kind="UInt8")
    topics = write_map(
        tmp_path,
        "topics: {joints: /joint_states, contacts: {topic: /skin, names: [pad_left, pad_right]}}",
    )
    (tmp_path / "hand.xml").write_text(HAND_XML)
    frames = read_recording(
        tmp_path / "bag", hand=tmp_path / "hand.xml", topics=topics
    ).measurements(10)
    assert [bool(f.contacts[0]) for f in frames] == [k >= 5 for k in range(10)]


def test_headers_that_nobody_stamped_give_way_to_receive_times_with_a_warning(tmp_path):
    with Writer2(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        bag = Bag(writer, store(), 2)
        for k in range(10):
            bag.pose("/truth/object_pose", 0.0, pose(k), receive=5 + 0.1 * k)
    recording = read_recording(tmp_path / "bag")
    np.testing.assert_allclose(recording.ground_truth.times, 5 + 0.1 * np.arange(10))
    assert "has no stamps in its headers; its receive times are used" in recording.warnings[0]


def test_a_topic_of_the_wrong_type_is_refused(tmp_path, topic_map):
    path = write_ros2(tmp_path / "bag", StoragePlugin.MCAP)
    wrong = write_map(
        tmp_path,
        topic_map.read_text().replace("joints: /robot/joint_states", "joints: /robot/wrist"),
    )
    with pytest.raises(
        RecordingError,
        match="/robot/wrist has type geometry_msgs/msg/PoseStamped, expected sensor_msgs/msg/JointState",
    ):
        read_recording(path, topics=wrong)


def test_a_named_topic_that_is_not_there_is_an_error_that_lists_those_that_are(tmp_path, topic_map):
    path = write_ros2(tmp_path / "bag", StoragePlugin.MCAP)
    wrong = write_map(tmp_path, topic_map.read_text().replace("/foundationpose/pose", "/fp/pose"))
    with pytest.raises(
        RecordingError, match=r"has no topic /fp/pose \(visual poses\); it has: .*/mocap/object"
    ):
        read_recording(path, topics=wrong).measurements()


def test_poses_in_the_camera_frame_need_the_cameras_pose(tmp_path, topic_map):
    path = write_ros2(tmp_path / "bag", StoragePlugin.MCAP)
    text = topic_map.read_text()
    without = write_map(tmp_path, text.replace("  camera_pose: /robot/camera\n", ""))
    with pytest.raises(RecordingError, match="the camera's pose is not known; give camera_pose"):
        read_recording(path, topics=without)
    x, y, z = T_WC.translation()
    qx, qy, qz, qw = T_WC.rotation().toQuaternion().coeffs()
    numbers = f"[{x}, {y}, {z}, {qx}, {qy}, {qz}, {qw}]"
    fixed = load_topics(write_map(tmp_path, text.replace("/robot/camera", numbers)))
    frame = read_recording(path, topics=fixed).measurements()[10]
    np.testing.assert_allclose(frame.T_wo_visual.matrix(), pose(0.33).matrix(), atol=1e-9)


def test_world_poses_that_call_themselves_camera_poses_raise_a_warning(tmp_path, topic_map):
    path = write_ros2(tmp_path / "bag", StoragePlugin.MCAP)
    world = write_map(tmp_path, topic_map.read_text().replace("frame: camera", "frame: world"))
    (warning,) = read_recording(path, topics=world).warnings
    assert "says its poses are in the frame 'camera', but they are taken as world poses" in warning
