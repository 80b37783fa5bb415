# SPDX-License-Identifier: MIT
"""Writes what a stranger's robot would bring: a mesh in millimetres and a ROS 2 bag, for practice.

A gripper with three pads closes on a bar of soap and turns it. A camera-based tracker sees the soap
some millimetres beside its place; the pads report ohms, which fall when pressed; a motion-capture system
knows the truth. Nothing here uses vtgtsam.

    python practice_bag.py FOLDER
"""

import sys
from pathlib import Path

import numpy as np
import trimesh
from gtsam import Pose3, Rot3
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

SOAP = (60.0, 40.0, 30.0)  # [mm]
CLOSED = 2.2  # [s], from when on the fingers hold the soap
SECONDS = 6.0
LATENCY = 0.06  # [s], of the tracker
OHMS = np.array([1200.0, 950.0, 1100.0])  # untouched
PRESSED = 0.6  # of a press with 6 N, which takes 400 ohms off

STORE = get_typestore(Stores.ROS2_HUMBLE)
MSG = STORE.types


def header(t, frame):
    sec, nanosec = divmod(round(t * 1e9), 10**9)
    stamp = MSG["builtin_interfaces/msg/Time"](sec=sec, nanosec=nanosec)
    return MSG["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)


def pose(t, T, frame):
    point = MSG["geometry_msgs/msg/Point"](*T.translation().tolist())
    quat_xyzw = T.rotation().toQuaternion().coeffs()
    quaternion = MSG["geometry_msgs/msg/Quaternion"](*quat_xyzw.tolist())
    body = MSG["geometry_msgs/msg/Pose"](point, quaternion)
    return MSG["geometry_msgs/msg/PoseStamped"](header(t, frame), body)


def joint_state(t):
    half_opening = 0.03 - 0.01 * np.clip(t - 1.0, 0.0, 1.0)  # [m]
    nothing = np.zeros(0)
    return MSG["sensor_msgs/msg/JointState"](
        header(t, ""), ["left", "right"], np.full(2, half_opening), nothing, nothing
    )


def ohms(t, rng):
    values = OHMS - 400.0 * PRESSED * (t >= CLOSED) + rng.normal(0.0, 3.0, 3)
    layout = MSG["std_msgs/msg/MultiArrayLayout"](dim=[], data_offset=0)
    return MSG["std_msgs/msg/Float32MultiArray"](layout, values.astype(np.float32))


def wrist(t):
    """The gripper in the world: it turns by 45 degrees from 3 s to 4 s."""
    return Pose3(Rot3.Rx(np.radians(45.0) * np.clip(t - 3.0, 0.0, 1.0)), [0.4, 0.0, 0.3])


IN_HAND = Pose3(Rot3(), [0.09, 0.0, 0.0])  # the soap in the gripper
SEEN_BESIDE = Pose3(Rot3.Rz(0.03), [0.003, 0.005, 0.001])  # what is wrong with the tracker
CAMERA = Pose3(Rot3.Rx(np.pi), [0.4, 0.0, 1.0])  # looks down


def main(folder):
    folder.mkdir(parents=True, exist_ok=True)
    trimesh.creation.box(extents=SOAP).subdivide().subdivide().export(folder / "soap.stl")
    rng = np.random.default_rng(0)
    with Writer(folder / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections = {}

        def write(topic, message, t):
            kind = message.__msgtype__
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, kind, typestore=STORE)
            data = STORE.serialize_cdr(message, kind)
            writer.write(connections[topic], round(t * 1e9), data)

        for t in np.arange(0.0, SECONDS, 0.01).tolist():
            write("/gripper/joint_states", joint_state(t), t)
            write("/gripper/skin", ohms(t, rng), t)
            write("/arm/wrist", pose(t, wrist(t), "world"), t)
            write("/mocap/soap", pose(t, wrist(t) * IN_HAND, "world"), t)
        for t in np.arange(0.0, SECONDS - LATENCY, 1 / 30).tolist():
            jitter = Pose3.Expmap(rng.normal(0.0, [5e-3] * 3 + [5e-4] * 3))  # [rad], [m]
            seen = CAMERA.inverse() * wrist(t) * IN_HAND * SEEN_BESIDE * jitter
            stamped = (
                t + LATENCY
            )  # this tracker stamps when it is done, not when the image was taken
            write("/tracker/soap", pose(stamped, seen, "camera"), stamped)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
