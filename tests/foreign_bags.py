# SPDX-License-Identifier: MIT
"""Bags written by the rosbags library under other people's topic names, and the map to read them with."""

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from sequences import SIDE, pose

from vtgtsam.recording import messages

T_WC = pose(0.4, angle=1.0)
LATENCY = 0.06

MAP = """
hand: hand.xml
object: ball
topics:
  joints: /robot/joint_states
  contacts: {topic: /skin/values, names: [pad_left, pad_right], threshold: 0.15}
  hand_pose: /robot/wrist
  vision: {topic: /foundationpose/pose, latency: 0.06, frame: camera}
  camera_pose: /robot/camera
  truth: /mocap/object
"""


def store(ros=2):
    typestore = get_typestore(Stores.ROS2_HUMBLE if ros == 2 else Stores.ROS1_NOETIC)
    text = messages.definition(messages.TACTILE_PADS)
    if ros == 2:
        typestore.register(get_types_from_msg(text, messages.TACTILE_PADS))
    return typestore


class Bag:
    """Writes messages of a bag of either ROS version."""

    def __init__(self, writer, typestore, ros):
        self.writer, self.types, self.store, self.ros = writer, typestore.types, typestore, ros
        self.connections = {}

    def header(self, t, frame=""):
        sec, nanosec = divmod(round(t * 1e9), 10**9)
        time = self.types["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
        header = self.types["std_msgs/msg/Header"]
        extra = {"seq": 0} if self.ros == 1 else {}
        return header(stamp=time, frame_id=frame, **extra)

    def write(self, topic, msgtype, message, receive):
        if topic not in self.connections:
            self.connections[topic] = self.writer.add_connection(
                topic, msgtype, typestore=self.store
            )
        serialize = self.store.serialize_cdr if self.ros == 2 else self.store.serialize_ros1
        data = serialize(message, msgtype)
        self.writer.write(self.connections[topic], round(receive * 1e9), data)

    def pose(self, topic, t, T, receive=None, frame="map"):
        quat_xyzw = T.rotation().toQuaternion().coeffs()
        position = self.types["geometry_msgs/msg/Point"](*map(float, T.translation()))
        orientation = self.types["geometry_msgs/msg/Quaternion"](*map(float, quat_xyzw))
        body = self.types["geometry_msgs/msg/Pose"](position, orientation)
        message = self.types[messages.POSE](self.header(t, frame), body)
        self.write(topic, messages.POSE, message, t if receive is None else receive)

    def joints(self, topic, t, names, values, receive=None):
        empty = np.zeros(0)
        message = self.types[messages.JOINT_STATE](
            self.header(t), list(names), np.array(values, float), empty, empty
        )
        self.write(topic, messages.JOINT_STATE, message, t if receive is None else receive)

    def array(self, topic, receive, values, kind="Float32"):
        layout = self.types["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
        dtype = {"Float32": np.float32, "Float64": np.float64, "UInt8": np.uint8}[kind]
        name = f"std_msgs/msg/{kind}MultiArray"
        self.write(topic, name, self.types[name](layout, np.array(values, dtype)), receive)


def fill(bag):
    """One second of a hand that turns, seen by a camera whose poses come late and unsorted."""
    bag.pose("/robot/camera", 0.0, T_WC)
    for k in range(100):
        t = 0.01 * k
        bag.joints("/robot/joint_states", t, ["j_right", "j_left"], [-t, t])
        bag.array("/skin/values", t, [0.2 if t >= 0.5 else 0.1, np.float32(0.15)])
        bag.pose("/robot/wrist", t, pose(t) * SIDE)
        bag.pose("/mocap/object", t, pose(t))
    order = [2, 0, 1, *range(3, 28)]
    for arrived, k in enumerate(order):
        T_co = T_WC.between(pose(0.033 * k))
        bag.pose("/foundationpose/pose", 0.033 * k + LATENCY, T_co, 0.1 + 0.03 * arrived, "camera")


def write_ros2(path, storage, **compression):
    with Writer2(
        path, version=9 if storage == StoragePlugin.MCAP else 8, storage_plugin=storage
    ) as w:
        fill(Bag(w, store(), 2))
    return path


def write_compressed(path):
    writer = Writer2(path, version=9, storage_plugin=StoragePlugin.MCAP)
    writer.set_compression(CompressionMode.FILE, CompressionFormat.ZSTD)
    with writer:
        fill(Bag(writer, store(), 2))
    return path


def write_ros1(path):
    path = path.with_suffix(".bag")
    with Writer1(path) as writer:
        fill(Bag(writer, store(1), 1))
    return path


WRITERS = {
    "rosbag2 MCAP": lambda path: write_ros2(path, StoragePlugin.MCAP),
    "rosbag2 sqlite3": lambda path: write_ros2(path, StoragePlugin.SQLITE3),
    "rosbag2 MCAP, compressed": write_compressed,
    "ROS 1": write_ros1,
}
