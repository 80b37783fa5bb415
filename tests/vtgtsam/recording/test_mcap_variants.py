# SPDX-License-Identifier: MIT
"""MCAP files as other programs write them: without chunks, index or definitions, or compressed otherwise."""

import pytest
from mcap.writer import CompressionType, IndexType, Writer
from sequences import JOINTS, PADS, gripper, pose

from vtgtsam.exceptions import RecordingError
from vtgtsam.recording import messages, read_recording


def write(path, encoding="ros2msg", message_encoding="cdr", with_text=True, **options):
    contents = {
        "/joint_states": (messages.JOINT_STATE, {"name": list(JOINTS), "position": [1.0, 2.0]}),
        "/tactile/contacts": (
            messages.TACTILE_PADS,
            {"name": list(PADS), "contact": [True, False]},
        ),
        "/vision/object_pose": (messages.POSE, {"pose": messages.pose_fields(pose(0.5))}),
    }
    with path.open("wb") as file:
        writer = Writer(file, **options)
        writer.start(profile="ros2")
        for topic, (msgtype, fields) in contents.items():
            text = messages.definition(msgtype).encode() if with_text else b""
            schema = writer.register_schema(msgtype, encoding, text)
            channel = writer.register_channel(topic, message_encoding, schema)
            for k in range(20):
                stamp = k * 10**8
                message = {"header": messages.header(stamp, ""), **fields}
                writer.add_message(channel, stamp, messages.encoder(msgtype)(message), stamp)
        writer.finish()
    return path


@pytest.mark.parametrize(
    "options",
    [
        {"use_chunking": False},
        {"use_chunking": False, "index_types": IndexType.NONE, "use_statistics": False},
        {"compression": CompressionType.NONE},
        {"compression": CompressionType.LZ4},
        {"enable_crcs": False},
        {"repeat_schemas": False, "repeat_channels": False, "use_summary_offsets": False},
        {"with_text": False},
        {"encoding": "", "with_text": False},
    ],
)
def test_it_is_read_like_any_other(tmp_path, options):
    recording = read_recording(write(tmp_path / "a.mcap", **options), hand=gripper())
    frames = recording.measurements()
    assert len(frames) == 20
    assert frames[7].joints.tolist() == [1.0, 2.0]
    assert frames[7].contacts.tolist() == [True, False]
    assert recording.warnings == []


def test_one_without_chunks_that_is_cut_off_gives_its_readable_part(tmp_path):
    path = write(tmp_path / "a.mcap", use_chunking=False, index_types=IndexType.NONE)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) * 3 // 4])
    recording = read_recording(path, hand=gripper())
    assert 0 < len(recording.measurements()) < 20
    (warning,) = recording.warnings
    assert "is cut off" in warning


def test_messages_that_are_not_of_ros_2_are_refused(tmp_path):
    path = write(tmp_path / "a.mcap", message_encoding="json")
    with pytest.raises(
        RecordingError, match="has messages encoded as 'json', expected ROS 2 messages"
    ):
        read_recording(path, hand=gripper())


def test_a_definition_that_makes_no_sense_is_refused(tmp_path):
    path = tmp_path / "a.mcap"
    with path.open("wb") as file:
        writer = Writer(file)
        writer.start(profile="ros2")
        schema = writer.register_schema(
            "std_msgs/msg/Float32MultiArray", "ros2idl", b"module std_msgs {};"
        )
        channel = writer.register_channel("/skin", "cdr", schema)
        writer.add_message(channel, 0, b"\x00\x01\x00\x00", 0)
        writer.finish()
    (tmp_path / "map.yaml").write_text("topics: {joints: /j, contacts: {topic: /skin, names: [a]}}")
    with pytest.raises(
        RecordingError,
        match="type std_msgs/msg/Float32MultiArray, whose definition is not understood",
    ):
        read_recording(path, topics=tmp_path / "map.yaml")
