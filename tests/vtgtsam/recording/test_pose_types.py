# SPDX-License-Identifier: MIT
"""Poses as other people's robots report them: transforms and odometry, in bags of either ROS."""

import numpy as np
import pytest
from foreign_bags import Bag, store
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from sequences import pose

from vtgtsam import read_recording
from vtgtsam.exceptions import RecordingError

MAP = """
topics: {joints: /j, contacts: /c, vision: /object, truth: TRUTH}
"""


class Robot(Bag):
    """Writes one pose as several types."""

    def body(self, T):
        quat_xyzw = T.rotation().toQuaternion().coeffs()
        quaternion = self.types["geometry_msgs/msg/Quaternion"](*map(float, quat_xyzw))
        return [float(x) for x in T.translation()], quaternion

    def transform(self, topic, t, T):
        numbers, quaternion = self.body(T)
        vector = self.types["geometry_msgs/msg/Vector3"](*numbers)
        transform = self.types["geometry_msgs/msg/Transform"](vector, quaternion)
        kind = "geometry_msgs/msg/TransformStamped"
        self.write(topic, kind, self.types[kind](self.header(t, "map"), "object", transform), t)

    def odometry(self, topic, t, T, covariance):
        numbers, quaternion = self.body(T)
        point = self.types["geometry_msgs/msg/Point"](*numbers)
        body = self.types["geometry_msgs/msg/Pose"](point, quaternion)
        known = self.types["geometry_msgs/msg/PoseWithCovariance"](body, covariance.ravel())
        zero = self.types["geometry_msgs/msg/Vector3"](0.0, 0.0, 0.0)
        still = self.types["geometry_msgs/msg/Twist"](zero, zero)
        twist = self.types["geometry_msgs/msg/TwistWithCovariance"](still, np.zeros(36))
        kind = "nav_msgs/msg/Odometry"
        message = self.types[kind](self.header(t, "map"), "object", known, twist)
        self.write(topic, kind, message, t)


def write(path, ros):
    if ros == 1:
        path, writer = path.with_suffix(".bag"), Writer1(path.with_suffix(".bag"))
    else:
        writer = Writer2(path, version=9, storage_plugin=StoragePlugin.MCAP)
    with writer:
        robot = Robot(writer, store(ros), ros)
        for k in range(5):
            t = 1.0 + 0.1 * k
            robot.transform("/mocap", t, pose(t))
            robot.odometry("/object", t, pose(t), np.diag([1e-6] * 3 + [1e-4] * 3))
    return path


@pytest.mark.parametrize("ros", [1, 2])
def test_transforms_and_odometry_are_poses(tmp_path, ros):
    (tmp_path / "map.yaml").write_text(MAP.replace("TRUTH", "/mocap"))
    recording = read_recording(write(tmp_path / "bag", ros), topics=tmp_path / "map.yaml")
    for trajectory in (recording.ground_truth, recording.visual_poses):
        times, poses = trajectory
        np.testing.assert_allclose(times, 1.0 + 0.1 * np.arange(5))
        for t, T in zip(times, poses, strict=True):
            assert T.equals(pose(t), 1e-9)
    (first, *_) = recording.streams.vision.covariances
    # ROS has translation first, we rotation; equal variances are the same in any axes.
    np.testing.assert_allclose(first, np.diag([1e-4] * 3 + [1e-6] * 3), atol=1e-15)
    assert recording.streams.truth.covariances == (None,) * 5


def test_what_is_no_pose_is_refused_with_the_types_that_are(tmp_path):
    (tmp_path / "map.yaml").write_text(MAP.replace("TRUTH", "/numbers"))
    with Writer2(tmp_path / "bag", version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        Robot(writer, store(), 2).array("/numbers", 1.0, [1, 2, 3])
    with pytest.raises(RecordingError, match="Float32MultiArray, expected .*TransformStamped"):
        read_recording(tmp_path / "bag", topics=tmp_path / "map.yaml")
