# SPDX-License-Identifier: MIT
"""An estimate as ROS says it; message classes are imported where they are used."""

from __future__ import annotations

from typing import Any

import gtsam
import numpy as np

from ..recording import messages
from ..recording.covariance import ros_from_tangent

UNKNOWN = 1e6  # [m^2], [rad^2], variance along what nothing measures: ROS has no word for infinity


def stamped(message: Any, stamp_ns: int, frame: str) -> Any:
    """The message with its header filled."""
    message.header.stamp.sec, message.header.stamp.nanosec = divmod(stamp_ns, 10**9)
    message.header.frame_id = frame
    return message


def fill_pose(pose: Any, T: gtsam.Pose3) -> None:
    """Fill a geometry_msgs/msg/Pose."""
    fields = messages.pose_fields(T)
    for part in ("position", "orientation"):
        for axis, value in fields[part].items():
            setattr(getattr(pose, part), axis, value)


def ros_covariance(covariance: np.ndarray, T: gtsam.Pose3) -> list[float]:
    """A covariance in ROS's order and axes, 36 numbers; finite.

    Args:
        covariance: Of the pose's right perturbation, rotation first, shape (6, 6), infinite along what nothing
            measures.
        T: The pose.
    """
    finite = np.where(np.isinf(covariance), np.copysign(UNKNOWN, covariance), covariance)
    found: list[float] = ros_from_tangent(finite, T.rotation()).ravel().tolist()
    return found


def pose_message(stamp_ns: int, frame: str, T_wo: gtsam.Pose3, covariance: np.ndarray) -> Any:
    """A geometry_msgs/msg/PoseWithCovarianceStamped."""
    from geometry_msgs.msg import PoseWithCovarianceStamped

    message = stamped(PoseWithCovarianceStamped(), stamp_ns, frame)
    fill_pose(message.pose.pose, T_wo)
    message.pose.covariance = ros_covariance(covariance, T_wo)
    return message


def transform_message(stamp_ns: int, frame: str, child: str, T_wo: gtsam.Pose3) -> Any:
    """A tf2_msgs/msg/TFMessage with the object's transform."""
    from geometry_msgs.msg import TransformStamped
    from tf2_msgs.msg import TFMessage

    transform = stamped(TransformStamped(), stamp_ns, frame)
    transform.child_frame_id = child
    fields = messages.pose_fields(T_wo)
    for axis, value in fields["position"].items():
        setattr(transform.transform.translation, axis, value)
    for axis, value in fields["orientation"].items():
        setattr(transform.transform.rotation, axis, value)
    return TFMessage(transforms=[transform])
