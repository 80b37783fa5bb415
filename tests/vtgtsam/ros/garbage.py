# SPDX-License-Identifier: MIT
"""Publishes what makes no sense on the other robot's topics, until it is ended."""

from __future__ import annotations

import random
import time

import rclpy
from geometry_msgs.msg import PoseStamped, PoseWithCovarianceStamped
from sensor_msgs.msg import JointState
from std_msgs.msg import Float32MultiArray

NUMBERS = (0.0, -1.0, 1e300, float("nan"), float("inf"), 1e-300)


def filled_pose(message, rng):
    pose = getattr(message.pose, "pose", message.pose)
    for part, axes in ((pose.position, "xyz"), (pose.orientation, "xyzw")):
        for axis in axes:
            setattr(part, axis, rng.choice(NUMBERS))
    message.header.stamp.sec = rng.choice((0, 1, 2**31 - 1, int(time.time())))
    return message


def main():
    rng = random.Random(1)
    rclpy.init()
    node = rclpy.create_node("garbage")
    joints = node.create_publisher(JointState, "/other/joints", 10)
    skin = node.create_publisher(Float32MultiArray, "/other/skin", 10)
    wrist = node.create_publisher(PoseStamped, "/other/wrist", 10)
    tracker = node.create_publisher(PoseWithCovarianceStamped, "/tracker/pose", 10)
    print("ready", flush=True)
    for _ in range(6000):  # two minutes
        message = JointState(name=["thumb_middle", "x"], position=[rng.choice(NUMBERS)])
        message.header.stamp.sec = rng.choice((0, 5, 2**31 - 1))
        joints.publish(message)
        skin.publish(Float32MultiArray(data=[rng.uniform(-1, 1)] * rng.randint(0, 15)))
        wrist.publish(filled_pose(PoseStamped(), rng))
        seen = filled_pose(PoseWithCovarianceStamped(), rng)
        seen.pose.covariance = [rng.choice(NUMBERS)] * 36
        tracker.publish(seen)
        time.sleep(0.02)


if __name__ == "__main__":
    main()
