# SPDX-License-Identifier: MIT
"""A robot of another make: plays a recorded grasp in real time, under names, rates, frames and types of its own.

    python robot.py RECORDING [--rate 1.0] [--late 0.08] [--only joints,contacts,...] [--seconds S] ...

Joints come from two publishers, arm and hand, each with a part of the names, the hand's in another order and beside
joints that nobody asked for; contacts are bytes without names or stamps... as PARTS says.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from pathlib import Path

import gtsam
import numpy as np
import rclpy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from rosgraph_msgs.msg import Clock
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32MultiArray

from vtgtsam import read_recording
from vtgtsam.recording import messages
from vtgtsam.recording.covariance import ros_from_tangent
from vtgtsam.ros.outgoing import fill_pose, stamped

T_WC = gtsam.Pose3(gtsam.Rot3.RzRyRx(-2.0, 0.1, 0.4), np.array([0.6, 0.1, 0.5]))
PRESSED, RELEASED = 0.8, 0.02  # of the other make's skin, in a unit of its own
PARTS = ("joints", "contacts", "wrist", "vision")


def topic_map(pad_names):
    x, y, z = T_WC.translation().tolist()
    q = T_WC.rotation().toQuaternion()
    return {
        "topics": {
            "joints": "/other/joints",
            "contacts": {"topic": "/other/skin", "names": list(pad_names), "threshold": 0.4},
            "hand_pose": "/other/wrist",
            "vision": {"topic": "/tracker/pose", "latency": LATENCY, "frame": "camera"},
            "camera_pose": [x, y, z, q.x(), q.y(), q.z(), q.w()],
        }
    }


LATENCY = 0.02  # [s], from image to stamp


class Robot:
    """Publishes a recording's streams; ``play`` returns when it is over."""

    def __init__(self, recording, given):
        self.given = given
        self.node = rclpy.create_node(given.name)
        self.streams = recording.streams
        self.hand = recording.hand
        make = self.node.create_publisher
        sensor = qos_profile_sensor_data
        latched = QoSProfile(
            depth=1,
            reliability=ReliabilityPolicy.RELIABLE,
            durability=DurabilityPolicy.TRANSIENT_LOCAL,
        )
        self.joints = [make(JointState, "/other/joints", quality) for quality in (sensor, 10)]
        self.skin = make(Float32MultiArray, "/other/skin", sensor)
        self.wrist = make(PoseStamped, "/other/wrist", latched)
        self.tracker = make(PoseWithCovarianceStamped, "/tracker/pose", 10)
        self.clock = make(Clock, "/clock", 10) if given.sim else None
        self.sent = []  # what was published: part, stamp [ns], instant of publishing [ns]

    def play(self):
        events = sorted(self.events(), key=lambda event: event[0])
        begin, first = time.monotonic(), events[0][0]
        self.offset = self.given.stamps or (time.time_ns() - first)
        for due, publish in events:
            if self.given.seconds and (due - first) / 1e9 > self.given.seconds:
                return
            left = begin + (due - first) / 1e9 / self.given.rate - time.monotonic()
            if left > 0:
                time.sleep(left)
            part, stamp = publish()
            self.sent.append((part, stamp + self.offset, time.time_ns()))

    def events(self):
        """When something becomes known [ns] and what is published then."""
        only, s = self.given.only.split(","), self.streams
        names = self.hand.joint_names
        parts = (names[:3], tuple(reversed(names[3:])))
        if "joints" in only:
            for stamp in s.joints.times_ns.tolist():
                for which, part in enumerate(parts):
                    angles = [self.at(s.joints, name, stamp) for name in part]
                    yield stamp, self.joint_event(which, stamp, part, angles)
        if "contacts" in only:
            for stamp in s.contacts.times_ns.tolist():
                bits = [self.at(s.contacts, name, stamp) for name in self.hand.pad_names]
                yield stamp, self.skin_event(stamp, bits)
        if "wrist" in only and s.hand_pose is not None:
            for stamp, pose in zip(s.hand_pose.times_ns.tolist(), s.hand_pose.poses, strict=True):
                yield stamp, self.wrist_event(stamp, pose)
        if "vision" in only:
            late = round(self.given.late * 1e9)
            for k, stamp in enumerate(s.vision.times_ns.tolist()):
                pose, covariance = s.vision.poses[k], s.vision.covariances[k]
                yield stamp + late, self.tracker_event(stamp, pose, covariance)
        if self.given.sim:
            first, last = int(s.joints.times_ns[0]), int(s.joints.times_ns[-1])
            for stamp in range(first, last, 10_000_000):
                yield stamp, self.clock_event(stamp)

    @staticmethod
    def at(stream, name, stamp):
        times, values = stream.columns[name]
        return float(values[max(int(np.searchsorted(times, stamp, side="right")) - 1, 0)])

    def joint_event(self, which, stamp, names, angles):
        def publish():
            message = stamped(JointState(), stamp + self.offset, "")
            message.name = [*names, "wheel"] if which else list(names)
            message.position = [*angles, 9.0] if which else angles
            self.joints[which].publish(message)
            return f"joints {which}", stamp

        return publish

    def skin_event(self, stamp, bits):
        def publish():
            felt = [PRESSED if bit > 0.5 else RELEASED for bit in bits]
            self.skin.publish(Float32MultiArray(data=felt))
            return "contacts", stamp

        return publish

    def wrist_event(self, stamp, pose):
        def publish():
            message = stamped(PoseStamped(), stamp + self.offset, "map")
            fill_pose(message.pose, pose)
            self.wrist.publish(message)
            return "wrist", stamp

        return publish

    def tracker_event(self, stamp, T_wo, covariance):
        T_co = T_WC.inverse().compose(T_wo)

        def publish():
            stamp_ns = stamp + self.offset + round(LATENCY * 1e9)
            message = stamped(PoseWithCovarianceStamped(), stamp_ns, "camera_color_optical_frame")
            fill_pose(message.pose.pose, T_co)
            if covariance is not None:
                ros = ros_from_tangent(covariance, T_co.rotation())
                message.pose.covariance = ros.ravel().tolist()
            self.tracker.publish(message)
            return "vision", stamp

        return publish

    def clock_event(self, stamp):
        def publish():
            message = Clock()
            message.clock.sec, message.clock.nanosec = divmod(stamp + self.offset, 10**9)
            self.clock.publish(message)
            return "clock", stamp

        return publish


def wait_for_listener(robot, given, seconds=20.0):
    """Until someone subscribes to what is played, or play to nobody."""
    publishers = {
        "joints": robot.joints[0],
        "contacts": robot.skin,
        "wrist": robot.wrist,
        "vision": robot.tracker,
    }
    needed = [publishers[name] for name in given.only.split(",")]
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if all(publisher.get_subscription_count() for publisher in needed):
            time.sleep(0.3)
            return
        time.sleep(0.05)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("recording")
    parser.add_argument("--name", default="other_robot")
    parser.add_argument("--only", default=",".join(PARTS))
    parser.add_argument("--rate", type=float, default=1.0)
    parser.add_argument("--late", type=float, default=0.08)
    parser.add_argument(
        "--stamps", type=int, default=0, help="added to the recording's [ns]; else now"
    )
    parser.add_argument("--seconds", type=float, default=0.0)
    parser.add_argument("--sent", help="file for what was published when")
    parser.add_argument("--sim", action="store_true", help="publish /clock, too")
    given = parser.parse_args()
    recording = read_recording(given.recording)
    rclpy.init()
    robot = Robot(recording, given)
    print("ready", flush=True)
    wait_for_listener(robot, given)
    robot.play()
    if given.sent:
        Path(given.sent).write_text(json.dumps(robot.sent))
    print("played", flush=True)
    time.sleep(0.5)
    robot.node.destroy_node()
    rclpy.try_shutdown()


if __name__ == "__main__":
    assert messages  # the recording's own conversions are used
    sys.exit(main())
