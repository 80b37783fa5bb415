# SPDX-License-Identifier: MIT
"""Bags as other makers' robots and programs write them, rebuilt small: each is right, or refused with what to do."""

import gtsam
import numpy as np
import pytest
from held_box import HAND_XML, PADS, box_obj
from robot_log import JOINTS, RobotLog, lifted
from rosbags.rosbag1 import Writer as Writer1
from rosbags.typesys import Stores, get_typestore

from vtgtsam.exceptions import RecordingError
from vtgtsam.recording import messages, read_recording
from vtgtsam.recording.inspect import inspect_recording

ROS2 = get_typestore(Stores.ROS2_HUMBLE)
BEHIND = gtsam.Pose3(
    gtsam.Rot3(), [0.0, 0.0, 0.004]
)  # the tracker sees the box 4 mm beside its place
CAMERA = gtsam.Pose3(gtsam.Rot3.Rx(np.pi), [0.4, 0.1, 1.2])
SECONDS = np.arange(0, 150) * 0.02


@pytest.fixture
def use(tmp_path):
    """Writes hand, object and map beside a bag and reads it: a recording with its measurements."""
    (tmp_path / "hand.xml").write_text(HAND_XML)
    (tmp_path / "box.obj").write_bytes(box_obj())

    def call(bag, topics, hand=None):
        if hand is not None:
            (tmp_path / "hand.xml").write_text(hand)
        lines = "\n".join(f"  {line}" for line in topics.strip().splitlines())
        (tmp_path / "map.yaml").write_text(f"hand: hand.xml\nobject: box.obj\ntopics:\n{lines}\n")
        recording = read_recording(bag, topics=tmp_path / "map.yaml")
        recording.measurements()
        return recording

    return call


def assert_right(recording, count=150, warnings=()):
    """Joints, pads, hand and vision are where they were, frame by frame."""
    frames = recording.measurements()
    assert len(frames) == count
    start = frames[0].time
    for frame in frames:
        T = lifted(frame.time - start)
        assert frame.T_wh.equals(T, 1e-3)
        assert frame.T_wo_visual.equals(T * BEHIND, 1e-3)
        np.testing.assert_allclose(frame.joints, np.zeros(4), atol=1e-6)
        assert frame.contacts.tolist() == [True] * 4
    assert len(recording.warnings) == len(warnings), recording.warnings
    for warning, words in zip(recording.warnings, warnings, strict=True):
        assert words in warning


def encode(kind, *fields):
    return bytes(ROS2.serialize_cdr(ROS2.types[kind](*fields), kind))


def text_of(kind):
    return ROS2.generate_msgdef(kind, ros_version=2)[0].encode()


def header(t, frame=""):
    sec, nanosec = divmod(round(t * 1e9), 10**9)
    T = ROS2.types
    return T["std_msgs/msg/Header"](T["builtin_interfaces/msg/Time"](sec, nanosec), frame)


def ros_pose(T, kind="Pose"):
    types = ROS2.types
    x, y, z = T.translation().tolist()
    q = types["geometry_msgs/msg/Quaternion"](*T.rotation().toQuaternion().coeffs().tolist())
    if kind == "Transform":
        return types["geometry_msgs/msg/Transform"](types["geometry_msgs/msg/Vector3"](x, y, z), q)
    return types["geometry_msgs/msg/Pose"](types["geometry_msgs/msg/Point"](x, y, z), q)


def transform(log, topic, t, T, parent, child, received=None):
    kind = "geometry_msgs/msg/TransformStamped"
    data = encode(kind, header(t, parent), child, ros_pose(T, "Transform"))
    log.raw(topic, kind, data, t if received is None else received, text=text_of(kind))


def array(log, topic, t, values, kind="Float32"):
    name = f"std_msgs/msg/{kind}MultiArray"
    layout = ROS2.types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
    dtype = {"Float32": np.float32, "Float64": np.float64, "UInt8": np.uint8}[kind]
    log.raw(topic, name, encode(name, layout, np.array(values, dtype)), t, text=text_of(name))


def joint_state(log, topic, t, joint_names, position=(), effort=()):
    kind = messages.JOINT_STATE
    arrays = [np.array(a, dtype=np.float64) for a in (position, [], effort)]
    log.raw(topic, kind, encode(kind, header(t), list(joint_names), *arrays), t, text=text_of(kind))


def test_an_arm_and_a_hand_that_share_joint_states(tmp_path, use):
    """UR and ros2_control: two publishers of different joints, an order that changes, wheels of NaN."""
    arm = [f"ur_{k}_joint" for k in range(6)]
    with RobotLog(tmp_path / "a.mcap") as log:
        for k, t in enumerate(1.7e9 + SECONDS):
            order = JOINTS if k % 2 else JOINTS[::-1]
            joint_state(log, "/joint_states", t, [*order, "wheel"], [0, 0, 0, 0, np.nan])
            joint_state(log, "/joint_states", t + 0.004, arm, np.sin([t] * 6))
            log.pads(t, [1] * 4)
            transform(log, "/tool0", t, lifted(t - 1.7e9), "base", "tool0")
            transform(log, "/object", t, lifted(t - 1.7e9) * BEHIND, "base", "object")
    recording = use(
        tmp_path / "a.mcap",
        "joints: /joint_states\ncontacts: /tactile/contacts\nhand_pose: /tool0\nvision: /object",
    )
    assert_right(recording, warnings=["values of wheel are left out"])


def test_a_hand_whose_pads_come_as_efforts(tmp_path, use):
    """Drivers that know no tactile message put the pads into a JointState."""
    with RobotLog(tmp_path / "a.mcap") as log:
        for t in 50.0 + SECONDS:
            joint_state(log, "/hand/joints", t, JOINTS, [0] * 4)
            joint_state(log, "/hand/touch", t, PADS, effort=[0.8, 1.2, 0.9, 0.7])
            log.pose("/wrist", t, lifted(t - 50))
            log.pose("/pose", t, lifted(t - 50) * BEHIND)
    topics = (
        "joints: /hand/joints\nhand_pose: /wrist\nvision: /pose\ncontacts: {topic: /hand/touch%s}"
    )
    assert_right(use(tmp_path / "a.mcap", topics % ", threshold: 0.5"))
    with pytest.raises(RecordingError, match="say in the topic map from which effort on a pad"):
        use(tmp_path / "a.mcap", topics % "")


def test_a_tracker_in_the_optical_frame_that_sends_the_identity_while_lost(tmp_path, use):
    """FoundationPose wrappers: poses in the camera, stamped when done, identity before the first."""
    with RobotLog(tmp_path / "a.mcap") as log:
        for k, t in enumerate(200.0 + SECONDS):
            log.joints(t, [0] * 4)
            array(log, "/skin", t, [255, 200, 255, 255], "UInt8")
            log.pose("/wrist", t, lifted(t - 200))
            T_co = CAMERA.between(lifted(t - 200) * BEHIND)
            seen = gtsam.Pose3() if 40 <= k < 60 else T_co
            log.pose("/fp", t + 0.12, seen, frame="camera_color_optical_frame", received=t + 0.12)
    x, y, z = CAMERA.translation()
    topics = (
        f"joints: /joint_states\nhand_pose: /wrist\ncamera_pose: [{x}, {y}, {z}, 1, 0, 0, 0]\n"
        "contacts: {topic: /skin, names: [pad_xp, pad_xn, pad_yp, pad_yn], threshold: 100}\n"
        "vision: {topic: /fp, latency: 0.12, frame: camera}"
    )
    assert_right(
        use(tmp_path / "a.mcap", topics), count=130, warnings=["20 of 150 messages are left out"]
    )


def test_a_simulator_whose_time_begins_at_0(tmp_path, use):
    """Isaac Sim and Gazebo with /clock: stamps from 0, received by the wall clock; Odometry."""
    kind = "nav_msgs/msg/Odometry"
    T = ROS2.types
    nothing = T["geometry_msgs/msg/Vector3"](0, 0, 0)
    twist = T["geometry_msgs/msg/TwistWithCovariance"](
        T["geometry_msgs/msg/Twist"](nothing, nothing), np.zeros(36)
    )
    with RobotLog(tmp_path / "a.mcap") as log:
        for t in SECONDS:
            wall = {"received": 1.7e9 + 3 * t}  # at a third of real time
            log.joints(t, [0] * 4, **wall)
            log.pads(t, [1] * 4, **wall)
            log.pose("/wrist", t, lifted(t), **wall)
            pose = T["geometry_msgs/msg/PoseWithCovariance"](
                ros_pose(lifted(t) * BEHIND), np.zeros(36)
            )
            data = encode(kind, header(t, "world"), "object", pose, twist)
            log.raw("/object/odom", kind, data, 1.7e9 + 3 * t, text=text_of(kind))
    topics = "joints: /joint_states\ncontacts: /tactile/contacts\nhand_pose: /wrist\nvision: /object/odom"
    assert_right(use(tmp_path / "a.mcap", topics))


def test_contacts_by_the_wall_clock_beside_stamps_of_a_simulator_are_refused(tmp_path, use):
    with RobotLog(tmp_path / "a.mcap") as log:
        for t in SECONDS:
            log.joints(t, [0] * 4, received=1.7e9 + t)
            array(log, "/skin", 1.7e9 + t, [1, 1, 1, 1])
            log.pose("/wrist", t, lifted(t), received=1.7e9 + t)
            log.pose("/pose", t, lifted(t), received=1.7e9 + t)
    topics = (
        "joints: /joint_states\nhand_pose: /wrist\nvision: /pose\n"
        "contacts: {topic: /skin, names: [pad_xp, pad_xn, pad_yp, pad_yn], threshold: 0.5}"
    )
    with pytest.raises(RecordingError, match="no frame has joints, contacts and hand at its time"):
        use(tmp_path / "a.mcap", topics)


def grasp(path, hand=lambda T: T, vision=lambda T: T * BEHIND, truth=None, ahead=None, **frames):
    """A grasp whose hand and vision are given otherwise."""
    with RobotLog(path) as log:
        for t in 10.0 + SECONDS:
            log.joints(t, [0] * 4)
            log.pads(t, [1] * 4)
            log.pose("/wrist", t, hand(lifted(t - 10)), frame=frames.get("wrist", "world"))
            stamp = t + (0.0 if ahead is None else ahead(t - 10))
            log.pose("/pose", stamp, vision(lifted(t - 10)), received=t)
            if truth is not None:
                log.pose("/mocap", t, truth(lifted(t - 10)), frame=frames.get("mocap", "world"))
    return path


TOPICS = "joints: /joint_states\ncontacts: /tactile/contacts\nhand_pose: /wrist\nvision: /pose\ntruth: /mocap"


def found(recording):
    return [finding.what for finding in recording.findings]


def test_motion_capture_with_y_up_is_far_from_the_hand(tmp_path, use):
    """OptiTrack's Motive streams with y up: the object is elsewhere, and its frame says so."""
    y_up = gtsam.Pose3(gtsam.Rot3.Rx(-np.pi / 2), np.zeros(3))
    bag = grasp(tmp_path / "a.mcap", truth=lambda T: y_up * T, mocap="optitrack")
    recording = use(bag, TOPICS)
    assert {"frames differ", "vision off the truth", "hand far from the object"} <= set(
        found(recording)
    )
    assert any("optitrack" in warning for warning in recording.warnings)


def test_a_wrist_in_millimetres_is_far_from_what_it_touches(tmp_path, use):
    def mm(T):
        return gtsam.Pose3(T.rotation(), 1e3 * T.translation())

    recording = use(grasp(tmp_path / "a.mcap", hand=mm, truth=lambda T: T), TOPICS)
    assert found(recording) == ["hand far from the object"]


def test_a_flange_in_the_place_of_the_hand_is_noticed(tmp_path, use):
    """The arm reports its flange; the hand is mounted 12 cm further on."""
    mounted = gtsam.Pose3(gtsam.Rot3(), [0.0, 0.0, -0.12])
    recording = use(
        grasp(tmp_path / "a.mcap", hand=lambda T: T * mounted, truth=lambda T: T), TOPICS
    )
    assert found(recording) == ["hand far from the object"]


def test_a_camera_whose_clock_is_set_while_it_records_is_noticed(tmp_path, use):
    """PTP takes over after 2 s: stamps leap by the 37 s between TAI and UTC, or creep by 0.2 s."""
    for ahead in (lambda t: 37.0 * (t > 2.0), lambda t: 0.07 * t):
        bag = grasp(tmp_path / "a.mcap", truth=lambda T: T, ahead=ahead)
        assert "clocks drift apart" in found(use(bag, TOPICS))


def test_a_bag_of_ros_1_with_everything_in_it(tmp_path, use):
    """Franka under Noetic: a .bag, contacts without header, TransformStamped from easy_handeye."""
    store = get_typestore(Stores.ROS1_NOETIC)
    T = store.types

    def stamped(t, frame=""):
        sec, nanosec = divmod(round(t * 1e9), 10**9)
        return T["std_msgs/msg/Header"](0, T["builtin_interfaces/msg/Time"](sec, nanosec), frame)

    def vector(kind, *values):
        return T[f"geometry_msgs/msg/{kind}"](*map(float, values))

    with Writer1(tmp_path / "a.bag") as writer:
        connections = {}

        def write(topic, kind, t, *fields):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=store)
            data = store.serialize_ros1(T[kind](*fields), kind)
            writer.write(connections[topic], round(t * 1e9), data)

        for t in 1.6e9 + SECONDS:
            empty = np.zeros(0)
            write(
                "/joints",
                messages.JOINT_STATE,
                t,
                stamped(t),
                list(JOINTS),
                np.zeros(4),
                empty,
                empty,
            )
            layout = T["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
            write("/tactip", "std_msgs/msg/Float64MultiArray", t, layout, np.full(4, 0.4))
            for topic, pose in (
                ("/wrist", lifted(t - 1.6e9)),
                ("/obj", lifted(t - 1.6e9) * BEHIND),
            ):
                q = vector("Quaternion", *pose.rotation().toQuaternion().coeffs())
                body = T["geometry_msgs/msg/Transform"](vector("Vector3", *pose.translation()), q)
                kind = "geometry_msgs/msg/TransformStamped"
                write(topic, kind, t, stamped(t, "panda_link0"), "x", body)
    topics = (
        "joints: /joints\nhand_pose: /wrist\nvision: /obj\n"
        "contacts: {topic: /tactip, names: [pad_xp, pad_xn, pad_yp, pad_yn], threshold: 0.3}"
    )
    assert_right(use(tmp_path / "a.bag", topics))


def test_joints_under_a_namespace_are_refused_with_both_names(tmp_path, use):
    with RobotLog(tmp_path / "a.mcap") as log:
        for t in SECONDS:
            log.joints(t, [0] * 4, [f"robot1/{name}" for name in JOINTS])
            log.pads(t, [1] * 4)
            log.pose("/pose", t, lifted(t))
    with pytest.raises(
        RecordingError,
        match="lacks the hand's joints j_pad_xp.* it has robot1/j_pad.* Names must be the same",
    ):
        use(
            tmp_path / "a.mcap", "joints: /joint_states\ncontacts: /tactile/contacts\nvision: /pose"
        )


def test_a_recording_of_foxglove_in_protobuf_is_refused_by_its_encoding(tmp_path, use):
    with RobotLog(tmp_path / "a.mcap") as log:
        for t in SECONDS:
            log.joints(t, [0] * 4)
            log.pads(t, [1] * 4)
            channel = {"encoding": "protobuf", "schema": "protobuf", "text": b"x"}
            log.raw("/pose", "foxglove.PoseInFrame", b"\x0a\x00", t, **channel)
    with pytest.raises(RecordingError, match="/pose has type foxglove.PoseInFrame, expected"):
        use(
            tmp_path / "a.mcap", "joints: /joint_states\ncontacts: /tactile/contacts\nvision: /pose"
        )
    assert [s.topic for s in inspect_recording(tmp_path / "a.mcap").streams][
        -1
    ] == "/tactile/contacts"


def test_a_topic_whose_type_changed_keeps_what_can_be_used(tmp_path, use):
    """A node was updated between two takes into one bag: Pose without a header, then PoseStamped."""
    with RobotLog(tmp_path / "a.mcap") as log:
        for k, t in enumerate(SECONDS):
            log.joints(t, [0] * 4)
            log.pads(t, [1] * 4)
            log.pose("/wrist", t, lifted(t))
            log.pose("/pose", t, lifted(t) * BEHIND)
            if k < 10:
                kind = "std_msgs/msg/String"
                log._channels.pop("/pose")
                log.raw("/pose", kind, encode(kind, "lost"), t, text=text_of(kind))
                log._channels.pop("/pose")
    recording = use(
        tmp_path / "a.mcap",
        "joints: /joint_states\ncontacts: /tactile/contacts\nhand_pose: /wrist\nvision: /pose",
    )
    assert_right(recording, warnings=["10 of 160 messages are left out, they are no geometry_msgs"])


def test_quaternions_in_single_precision_are_poses(tmp_path, use):
    """An embedded tracker rounds: norms are off by 1e-4, and one in ten is never filled in."""

    with RobotLog(tmp_path / "a.mcap") as log:
        for k, t in enumerate(SECONDS):
            log.joints(t, [0] * 4)
            log.pads(t, [1] * 4)
            log.pose("/wrist", t, lifted(t))
            pose = messages.pose_fields(lifted(t) * BEHIND)
            scale = 0.0 if k % 10 == 5 else 1.0001
            pose["orientation"] = {axis: scale * q for axis, q in pose["orientation"].items()}
            log.message("/pose", messages.POSE, t, {"pose": pose})
    recording = use(
        tmp_path / "a.mcap",
        "joints: /joint_states\ncontacts: /tactile/contacts\nhand_pose: /wrist\nvision: /pose",
    )
    assert_right(recording, count=135, warnings=["15 of 150 messages are left out"])


def test_another_hand_than_the_bags_is_noticed_by_where_it_touches(tmp_path, use):
    """The same joints and pads by name, on a hand of another size."""
    larger = HAND_XML.replace("0.02 0.0 0", "0.12 0.0 0").replace("-0.02 ", "-0.12 ")
    larger = larger.replace("0.03 0", "0.13 0")
    recording = use(grasp(tmp_path / "a.mcap", truth=lambda T: T), TOPICS, hand=larger)
    assert any("touch" in what or "far" in what for what in found(recording))
