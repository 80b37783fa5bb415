# SPDX-License-Identifier: MIT
"""Whatever a bag holds, `inspect` lists it, and judges what is used."""

import json

import numpy as np
import zstandard
from robot_log import RobotLog, lifted, send, write_log
from rosbags.typesys import Stores, get_typestore

from vtgtsam.recording import load_topics, messages, names, read_recording
from vtgtsam.recording.inspect import inspect_recording


def stream(found, topic):
    (one,) = (s for s in found.streams if s.topic == topic)
    return one


def add(path, *more):
    """A sound log with other messages beside its own; each of ``more`` is called with log and instant."""

    def change(log, topic, t, what):
        if topic == names.JOINTS:
            for one in more:
                one(log, t)

    return write_log(path, change)


def test_topics_that_cannot_be_decoded_are_listed_and_no_problem(tmp_path):
    def json_topic(log, t):
        channel = {"encoding": "json", "schema": "jsonschema", "text": b"{}"}
        log.raw("/debug", "Debug", json.dumps({"t": t}).encode(), t, **channel)

    def broken(log, t):  # of a type that we know, but not its bytes
        log.raw("/other/joints", messages.JOINT_STATE, b"\x00\x01\x00\x00\xff", t)

    def unknown(log, t):
        log.raw("/unknown", "my_msgs/msg/Thing", b"\x00\x01\x00\x00", t, text=b"")

    found = inspect_recording(add(tmp_path / "a.mcap", json_topic, broken, unknown))
    for topic in ("/debug", "/other/joints", "/unknown"):
        assert stream(found, topic).count == 150
        assert stream(found, topic).undecoded == 150
        assert stream(found, topic).start == 100.0  # of receipt
    assert found.problems == []


def odometry(t):
    """nav_msgs/msg/Odometry with this stamp [s], as bytes and definition."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    text, _ = store.generate_msgdef("nav_msgs/msg/Odometry", ros_version=2)
    T = store.types
    sec, nanosec = divmod(round(t * 1e9), 10**9)
    header = T["std_msgs/msg/Header"](T["builtin_interfaces/msg/Time"](sec, nanosec), "odom")
    point, q = T["geometry_msgs/msg/Point"](0, 0, 0), T["geometry_msgs/msg/Quaternion"](0, 0, 0, 1)
    vector = T["geometry_msgs/msg/Vector3"](0, 0, 0)
    pose = T["geometry_msgs/msg/PoseWithCovariance"](
        T["geometry_msgs/msg/Pose"](point, q), np.zeros(36)
    )
    twist = T["geometry_msgs/msg/TwistWithCovariance"](
        T["geometry_msgs/msg/Twist"](vector, vector), np.zeros(36)
    )
    message = T["nav_msgs/msg/Odometry"](header, "base", pose, twist)
    return bytes(store.serialize_cdr(message, "nav_msgs/msg/Odometry")), text.encode()


def test_stamps_count_whatever_the_type_and_receipt_is_told_beside_them(tmp_path):
    def late(log, t):
        data, text = odometry(t)
        log.raw("/odom", "nav_msgs/msg/Odometry", data, t + 0.25, text=text)

    found = inspect_recording(add(tmp_path / "a.mcap", late))
    assert stream(found, "/odom").start == 100.0
    assert abs(stream(found, "/odom").delay - 0.25) < 1e-6
    (line,) = (line for line in found.lines() if "/odom" in line)
    assert line.endswith("received 250 ms after its stamp")


def test_simulation_time_begins_at_0_and_pauses_for_nothing(tmp_path):
    def change(log, topic, t, what):
        return send(log, topic, t - 100.0, received=1.7e9 + t, **what)

    found = inspect_recording(write_log(tmp_path / "a.mcap", change))
    assert stream(found, names.JOINTS).start == 0.0
    assert stream(found, names.JOINTS).longest_gap < 0.03
    assert found.problems == []


def test_pauses_of_what_nobody_reads_are_no_problem(tmp_path):
    def rare(log, t):
        if not 100.5 < t < 102.5:
            log.pose("/rare", t, lifted(0.0))

    assert inspect_recording(add(tmp_path / "a.mcap", rare)).problems == []


def test_two_publishers_in_step_have_a_rate(tmp_path):
    def twin(log, t):
        for name in "ab":
            log.joints(t, [0.0], [name], topic="/twins")

    twins = stream(inspect_recording(add(tmp_path / "a.mcap", twin)), "/twins")
    assert 90 < twins.rate < 110


def test_messages_compressed_one_by_one_are_read(tmp_path):
    """`ros2 bag record --compression-mode message` in an MCAP file; its metadata.yaml is gone."""

    def change(log, topic, t, what):
        before = log.raw
        log.raw = lambda topic, msgtype, data, received, **k: before(
            topic, msgtype, zstandard.compress(data), received, **k
        )
        try:
            return send(log, topic, t, **what)
        finally:
            log.raw = before

    path = write_log(tmp_path / "a.mcap", change)
    assert len(read_recording(path).measurements()) == 150
    assert inspect_recording(path).problems == []


def test_ros_1_messages_in_mcap_are_read(tmp_path):
    """As `mcap convert x.bag x.mcap` writes them."""
    store = get_typestore(Stores.ROS1_NOETIC)
    T = store.types
    text, _ = store.generate_msgdef(messages.JOINT_STATE, ros_version=1)

    def joints(log, t):
        sec, nanosec = divmod(round(t * 1e9), 10**9)
        header = T["std_msgs/msg/Header"](0, T["builtin_interfaces/msg/Time"](sec, nanosec), "")
        empty = np.zeros(0)
        message = T[messages.JOINT_STATE](header, ["a"], np.array([t]), empty, empty)
        data = bytes(store.serialize_ros1(message, messages.JOINT_STATE))
        channel = {"encoding": "ros1", "schema": "ros1msg", "text": text.encode()}
        log.raw("/joints", "sensor_msgs/JointState", data, t, **channel)

    path = tmp_path / "a.mcap"
    with RobotLog(path) as log:
        for k in range(20):
            joints(log, 100.0 + 0.05 * k)
    found = inspect_recording(path)
    assert stream(found, "/joints").msgtype == messages.JOINT_STATE
    (tmp_path / "map.yaml").write_text("topics: {joints: /joints, contacts: /c}")
    columns = read_recording(path, topics=load_topics(tmp_path / "map.yaml")).streams.joints.columns
    assert columns["a"][1][3] == 100.15


def test_arrays_whose_definition_the_file_lacks_are_read(tmp_path):
    """Bags of ROS 2 Foxy and Galactic hold no definitions, and some recorders write IDL."""
    kind = "std_msgs/msg/Float32MultiArray"
    store = get_typestore(Stores.ROS2_HUMBLE)
    layout = store.types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
    message = store.types[kind](layout, np.array([0.9, 0.1], np.float32))
    data = bytes(store.serialize_cdr(message, kind))
    (tmp_path / "map.yaml").write_text(
        "topics: {joints: /j, contacts: {topic: /skin, names: [a, b], threshold: 0.5}}"
    )
    for schema, text in (("", b""), ("ros2msg", b""), ("ros2idl", b"")):
        path = tmp_path / f"{schema or 'none'}.mcap"
        with RobotLog(path) as log:
            for k in range(10):
                log.raw("/skin", kind, data, 0.1 * k, schema=schema, text=text)
        columns = read_recording(path, topics=tmp_path / "map.yaml").streams.contacts.columns
        assert (columns["a"][1][0], columns["b"][1][0]) == (1.0, 0.0)


def test_a_transform_tree_in_the_place_of_a_pose_says_what_to_do(tmp_path):
    (tmp_path / "map.yaml").write_text(
        "topics: {joints: /joint_states, contacts: /tactile/contacts, hand_pose: /tf}"
    )

    def tf(log, t):
        log.raw("/tf", "tf2_msgs/msg/TFMessage", b"\x00\x01\x00\x00", t, text=b"int8 x")

    found = inspect_recording(add(tmp_path / "a.mcap", tf), topics=tmp_path / "map.yaml")
    assert "/tf is not read: publish that transform as a PoseStamped" in found.problems[0]
