# SPDX-License-Identifier: MIT
"""A recording as others read it: Rerun's own MCAP importer, and what Foxglove asks of schemas."""

import numpy as np
import pandas as pd
import pytest
from mcap.reader import make_reader
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from sequences import JOINTS, PADS, pose

from vtgtsam.camera import CameraIntrinsics
from vtgtsam.recording import RecordingWriter

INTRINSICS = CameraIntrinsics(6, 4, 5.0, 5.0, 2.5, 1.5)
COUNT = 5


@pytest.fixture(scope="module")
def path(tmp_path_factory):
    """A recording with every kind of message."""
    path = tmp_path_factory.mktemp("viewers") / "all.mcap"
    with RecordingWriter(path, {"object": "can"}) as writer:
        writer.camera_pose(1.0, pose(0.5))
        writer.camera_info(1.0, INTRINSICS)
        for k in range(COUNT):
            t = 1.0 + 0.1 * k
            writer.joint_states(t, JOINTS, [t, -t])
            writer.tactile(t, PADS, [0.5, 0.0], [True, False])
            writer.hand_pose(t, pose(0.0))
            writer.object_pose(t, pose(t))
            writer.truth(t, pose(t))
            writer.estimate(t, pose(t))
            writer.depth(t, np.full((4, 6), 0.5))
            writer.color(t, np.zeros((4, 6, 3), np.uint8))
    return path


@pytest.fixture(scope="module")
def imported(path):
    """Tables of the entities that Rerun's importer makes of it."""
    rerun_chunk = pytest.importorskip("rerun.chunk", reason="Rerun (extra viz) is not installed")
    tables = {}
    for chunk in rerun_chunk.McapReader(path).stream():
        table = chunk.to_record_batch().to_pandas()
        if "ros2_timestamp" in table:
            tables.setdefault(chunk.entity_path, []).append(table.set_index("ros2_timestamp"))
    return {entity: pd.concat(parts) for entity, parts in tables.items()}


@pytest.mark.parametrize("topic", ["/vision/object_pose", "/truth/object_pose", "/hand/pose"])
def test_rerun_shows_poses_as_poses_at_their_stamps(imported, topic):
    poses = imported[topic]["InstancePoses3D:translations"].dropna()
    assert len(poses) == COUNT
    stamps = [pd.Timestamp(stamp).value / 1e9 for stamp in poses.index]
    assert stamps == pytest.approx([1.0 + 0.1 * k for k in range(COUNT)], abs=1e-9)
    for stamp, translation in zip(stamps, poses, strict=True):
        expected = pose(0.0 if topic == "/hand/pose" else stamp).translation()
        np.testing.assert_allclose(translation[0], expected, atol=1e-6)


def test_rerun_plots_joint_angles_by_name_and_shows_images_through_the_camera(imported):
    angles = np.stack(list(imported["/joint_states/position"]["Scalars:scalars"].dropna()))
    np.testing.assert_allclose(angles[:, 0], 1.0 + 0.1 * np.arange(COUNT))
    np.testing.assert_allclose(angles[:, 1], -angles[:, 0])
    assert imported["/camera/depth"]["EncodedImage:blob"].notna().sum() == COUNT
    assert imported["/camera/color"]["EncodedImage:blob"].notna().sum() == COUNT
    matrix = imported["/camera/info"]["Pinhole:image_from_camera"].dropna().iloc[0][0]
    np.testing.assert_allclose(np.reshape(matrix, (3, 3)).T, INTRINSICS.matrix)


def test_rerun_unpacks_our_own_message_by_its_embedded_definition(imported):
    column = "vtgtsam_msgs.msg.TactilePads:message"
    message = imported["/tactile/contacts"][column].dropna().iloc[0]
    assert "contact" in str(message) and "pad_left" in str(message)


def test_schemas_are_what_foxglove_asks_of_ros_2(path):
    """Profile ros2, CDR messages, ros2msg definitions under ROS names that an independent parser reads."""
    with path.open("rb") as file:
        reader = make_reader(file)
        summary, header = reader.get_summary(), reader.get_header()
    assert header.profile == "ros2"
    topics = {channel.topic for channel in summary.channels.values()}
    assert len(topics) == 10 and all(topic.startswith("/") for topic in topics)
    assert {channel.message_encoding for channel in summary.channels.values()} == {"cdr"}
    for schema in summary.schemas.values():
        assert schema.encoding == "ros2msg"
        package, kind, name = schema.name.split("/")
        assert kind == "msg" and package.endswith("_msgs") and name[0].isupper()
        types = get_types_from_msg(schema.data.decode(), schema.name)
        get_typestore(Stores.EMPTY).register(types)


def test_every_message_decodes_with_rosbags_own_types(path):
    """ROS's definitions, not ours, read the bytes: what `ros2 topic echo` would print."""
    typestore = get_typestore(Stores.ROS2_HUMBLE)
    count = 0
    with path.open("rb") as file:
        for schema, _, message in make_reader(file).iter_messages():
            if not schema.name.startswith("vtgtsam"):
                decoded = typestore.deserialize_cdr(message.data, schema.name)
                stamp = decoded.header.stamp
                assert stamp.sec * 10**9 + stamp.nanosec == message.log_time
                count += 1
    assert count == 7 * COUNT + 2
