# SPDX-License-Identifier: MIT
import os
import signal
import subprocess
import sys

import gtsam
import numpy as np
import pytest
from mcap.reader import make_reader
from mcap.records import Chunk, Message
from mcap.stream_reader import StreamReader, breakup_chunk
from mcap_ros2.decoder import DecoderFactory
from rosbags.rosbag2 import Reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from sequences import HAND_XML, JOINTS, PADS, pose, write_sequence

from vtgtsam.camera import CameraIntrinsics
from vtgtsam.recording import RecordingWriter, messages, read_recording

MESH = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"


def test_the_mcap_library_opens_it_and_finds_schemas_values_metadata_and_attachments(tmp_path):
    path = write_sequence(
        tmp_path / "a.mcap", metadata={"object": "can"}, hand_xml=HAND_XML, mesh=MESH
    )
    with path.open("rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        assert reader.get_header().profile == "ros2"
        by_topic = {}
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            assert schema.encoding == "ros2msg" and channel.message_encoding == "cdr"
            assert message.log_time == messages.stamp_ns(decoded)
            by_topic.setdefault((channel.topic, schema.name), []).append(decoded)
        metadata = {record.name: record.metadata for record in reader.iter_metadata()}
        attachments = {a.name: a.data for a in reader.iter_attachments()}
    assert {topic: len(found) for topic, found in by_topic.items()} == {
        ("/camera/pose", "geometry_msgs/msg/PoseStamped"): 1,
        ("/joint_states", "sensor_msgs/msg/JointState"): 300,
        ("/tactile/contacts", "vtgtsam_msgs/msg/TactilePads"): 300,
        ("/hand/pose", "geometry_msgs/msg/PoseStamped"): 300,
        ("/truth/object_pose", "geometry_msgs/msg/PoseStamped"): 300,
        ("/vision/object_pose", "geometry_msgs/msg/PoseStamped"): 90,
    }
    joints = by_topic["/joint_states", "sensor_msgs/msg/JointState"][100]
    assert (joints.name, list(joints.position)) == (list(JOINTS), [2.0, -2.0])
    pads = by_topic["/tactile/contacts", "vtgtsam_msgs/msg/TactilePads"][100]
    assert (pads.name, list(pads.pressure), list(pads.contact)) == (
        list(PADS),
        [0.5, 0.0],
        [True, False],
    )
    assert metadata["vtgtsam"]["object"] == "can"
    assert metadata["vtgtsam"]["version"]
    assert attachments == {"hand.xml": HAND_XML.encode(), "object.obj": MESH}


def test_the_rosbags_library_opens_it_and_reads_the_same_values(tmp_path):
    folder = tmp_path / "bag"
    folder.mkdir()
    path = write_sequence(folder / "a.mcap")
    typestore = get_typestore(Stores.ROS2_HUMBLE)
    with Reader(path) as reader:
        for connection in reader.connections:
            typestore.register(get_types_from_msg(connection.msgdef.data, connection.msgtype))
        found = {}
        for connection, _, data in reader.messages():
            message = typestore.deserialize_cdr(data, connection.msgtype)
            found.setdefault(connection.topic, []).append(message)
    assert len(found["/joint_states"]) == 300
    assert found["/joint_states"][100].position.tolist() == [2.0, -2.0]
    assert found["/tactile/contacts"][100].contact.tolist() == [True, False]
    position = found["/truth/object_pose"][100].pose.position
    assert (position.x, position.y, position.z) == (2.0, 0.02, 0.1)


@pytest.mark.parametrize(
    "msgtype",
    [
        messages.JOINT_STATE,
        messages.POSE,
        messages.POSE_WITH_COVARIANCE,
        messages.COMPRESSED_IMAGE,
        messages.CAMERA_INFO,
    ],
)
def test_our_definitions_are_those_of_ros_2(msgtype):
    ros = get_typestore(Stores.ROS2_JAZZY)
    ours = get_typestore(Stores.EMPTY)
    ours.register(get_types_from_msg(messages.definition(msgtype), msgtype))
    # The hash covers every field's name and type, those of the parts included (REP 2011).
    assert ours.hash_rihs01(msgtype) == ros.hash_rihs01(msgtype)


def test_our_own_message_file_is_part_of_its_definition_as_it_ships():
    text = messages.definition(messages.TACTILE_PADS)
    fields = get_types_from_msg(text, messages.TACTILE_PADS)[messages.TACTILE_PADS][1]
    assert [name for name, _ in fields] == ["header", "name", "pressure", "contact"]


def test_the_same_calls_give_the_same_bytes(tmp_path):
    image = np.random.default_rng(0).uniform(0.3, 1.0, (48, 64))
    contents = []
    for name in ("a.mcap", "b.mcap"):
        with RecordingWriter(
            tmp_path / name, {"seed": "1"}, hand_xml=HAND_XML, mesh=MESH
        ) as writer:
            for k in range(200):
                writer.joint_states(0.01 * k, JOINTS, [k, -k])
                writer.object_pose(0.01 * k, pose(k), np.eye(6))
            writer.depth(1.0, image)
            writer.color(1.0, (image[..., None] * [255, 128, 0]).astype(np.uint8))
        contents.append((tmp_path / name).read_bytes())
    assert contents[0] == contents[1]


def chunks(path):
    with path.open("rb") as file:
        return [r for r in StreamReader(file, emit_chunks=True).records if isinstance(r, Chunk)]


def test_no_chunk_is_larger_than_64_kib_or_longer_than_a_second(tmp_path):
    path = tmp_path / "a.mcap"
    names = [f"joint_{k}" for k in range(40)]
    with RecordingWriter(path) as writer:
        for k in range(3000):  # 40 joints at 100 Hz fill 64 KiB before a second has passed
            writer.joint_states(0.01 * k, names, np.zeros(40))
        for k in range(300):  # at 10 Hz a second passes first
            writer.hand_pose(30 + 0.1 * k, pose(k))
    found = chunks(path)
    assert max(chunk.uncompressed_size for chunk in found) <= 64 * 1024
    assert max(chunk.uncompressed_size for chunk in found) > 60 * 1024
    assert max(chunk.message_end_time - chunk.message_start_time for chunk in found) < 10**9
    stored = [r for chunk in found for r in breakup_chunk(chunk) if isinstance(r, Message)]
    assert len(stored) == 3300


def test_a_killed_program_loses_a_second_at_most(tmp_path):
    path = tmp_path / "killed.mcap"
    program = f"""
import os, signal
from vtgtsam.recording import RecordingWriter
writer = RecordingWriter({str(path)!r}, {{"object": "can"}})
for k in range(1000):
    writer.joint_states(0.01 * k, ["j"], [k])
os.kill(os.getpid(), signal.SIGKILL)
"""
    killed = subprocess.run(
        [sys.executable, "-c", program], env={**os.environ, "OMP_NUM_THREADS": "1"}
    )
    assert killed.returncode == -signal.SIGKILL
    recording = read_recording(path)
    assert recording.info["object"] == "can"
    assert len(recording.warnings) == 1 and "is cut off" in recording.warnings[0]
    last_s = recording._streams.joints.times_ns[-1] / 1e9
    assert 9.99 - last_s <= 1.0


def test_how_long_errors_stay_alike_comes_back_with_its_pose(tmp_path):
    with RecordingWriter(tmp_path / "a.mcap", {}) as writer:
        for k in range(3):
            if k != 1:
                writer.vision_correlation(0.1 * k, 2.5 + k)
            writer.object_pose(0.1 * k, pose(k))
    stream = read_recording(tmp_path / "a.mcap").streams.vision
    assert [stream.correlation(k) for k in range(3)] == [2.5, 0.0, 4.5]
    kept = stream.chosen(np.array([False, False, True]))
    assert kept.correlation(0) == 4.5


def test_an_exception_in_the_with_statement_still_leaves_a_complete_file(tmp_path):
    with pytest.raises(KeyboardInterrupt), RecordingWriter(tmp_path / "a.mcap") as writer:
        writer.joint_states(0.0, JOINTS, [0, 0])
        raise KeyboardInterrupt
    assert read_recording(tmp_path / "a.mcap").warnings == []


def test_close_may_be_called_twice(tmp_path):
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        writer.joint_states(0.0, JOINTS, [0, 0])
        writer.close()
    assert read_recording(tmp_path / "a.mcap").warnings == []


def test_camera_info_has_the_intrinsics_in_k_and_p(tmp_path):
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        writer.camera_info(0.0, CameraIntrinsics(640, 480, 610.0, 611.0, 319.5, 239.5))
    with (tmp_path / "a.mcap").open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        ((_, _, _, info),) = reader.iter_decoded_messages()
    assert (info.width, info.height, info.distortion_model) == (640, 480, "plumb_bob")
    assert list(info.k) == [610.0, 0, 319.5, 0, 611.0, 239.5, 0, 0, 1]
    assert list(info.p) == [610.0, 0, 319.5, 0, 0, 611.0, 239.5, 0, 0, 0, 1, 0]


NAN_POSE = gtsam.Pose3(gtsam.Rot3(), np.array([np.nan, 0, 0]))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (
            lambda w: w.joint_states(0, ["a", "b"], [0.0]),
            r"joint angles must have shape \(2,\), got \(1,\)",
        ),
        (lambda w: w.joint_states(0, ["a"], [np.nan]), "joint angles must be finite"),
        (lambda w: w.tactile(0, ["a"], [0.0], [True, False]), r"contacts must have shape \(1,\)"),
        (lambda w: w.truth(0, NAN_POSE), "a pose must be finite"),
        (lambda w: w.truth(float("nan"), gtsam.Pose3()), "time must be seconds"),
        (lambda w: w.truth(-1, gtsam.Pose3()), "time must be seconds"),
        (
            lambda w: w.vision_correlation(0, -1.0),
            "correlation must be seconds, at least 0, got -1.0",
        ),
        (
            lambda w: w.object_pose(0, gtsam.Pose3(), np.eye(3)),
            r"covariance must have shape \(6, 6\)",
        ),
        (lambda w: w.depth(0, np.zeros((4, 4, 3))), r"a depth image must have shape \(H, W\)"),
        (lambda w: w.color(0, np.zeros((4, 4))), "a colour image must be uint8"),
    ],
)
def test_wrong_values_are_refused(tmp_path, call, message):
    with RecordingWriter(tmp_path / "a.mcap") as writer, pytest.raises(ValueError, match=message):
        call(writer)


def test_a_covariance_after_poses_without_one_is_refused(tmp_path):
    with RecordingWriter(tmp_path / "a.mcap") as writer:
        writer.object_pose(0.0, gtsam.Pose3())
        with pytest.raises(ValueError, match="give all or none"):
            writer.object_pose(0.1, gtsam.Pose3(), np.eye(6))


def test_metadata_that_is_no_text_is_refused(tmp_path):
    with pytest.raises(ValueError, match="must be strings, these are not: seed"):
        RecordingWriter(tmp_path / "a.mcap", {"seed": 1})
