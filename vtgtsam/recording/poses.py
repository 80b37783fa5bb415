# SPDX-License-Identifier: MIT
"""A topic of poses over time."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import SimpleNamespace
from typing import Any

import gtsam
import numpy as np

from . import messages
from .covariance import is_known, tangent_from_ros
from .decode import decode, in_order, note
from .source import BagMessage

# Written are the first two; the others are what other people's robots report.
TYPES = (
    messages.POSE,
    messages.POSE_WITH_COVARIANCE,
    "geometry_msgs/msg/TransformStamped",
    "nav_msgs/msg/Odometry",
)


@dataclass(frozen=True)
class PoseStream:
    """Poses of one topic.

    Attributes:
        times_ns: Stamps [ns], int64, shape (N,), increasing, N > 0.
        poses: The N poses.
        covariances: Of each pose, shape (6, 6), right perturbation, rotation first; None where not given.
        frame: The frame that the first message says it is given in.
    """

    times_ns: np.ndarray
    poses: Sequence[gtsam.Pose3]
    covariances: Sequence[np.ndarray | None]
    frame: str

    def held(self, instants_ns: np.ndarray) -> np.ndarray:
        """Index of the last pose at or before each instant, shape (F,); -1 where there is none.

        A topic with a single pose says where something is that never moves, whenever it came.
        """
        if len(self.poses) == 1:
            return np.zeros(len(instants_ns), dtype=np.int64)
        return np.searchsorted(self.times_ns, instants_ns, side="right") - 1


def read_poses(topic: str, bag: Sequence[BagMessage], warnings: list[str]) -> PoseStream | None:
    """The poses of a topic, or None where it has none that can be used."""
    decoded = decode(topic, bag, TYPES, warnings)
    found: list[tuple[int, gtsam.Pose3, np.ndarray | None]] = []
    for stamp, message in decoded:
        pose = messages.pose_from_fields(_pose_fields(message))
        if pose is not None:
            found.append((stamp, pose, _covariance(message, pose)))
    why = "are not finite or have a quaternion whose norm is not 1"
    note(warnings, topic, len(decoded) - len(found), len(decoded), why)
    found = in_order(found, topic, warnings)
    if not found:
        return None
    stamps, poses, covariances = zip(*found, strict=True)
    frame = str(decoded[0][1].header.frame_id)
    return PoseStream(np.array(stamps, dtype=np.int64), poses, covariances, frame)


def _pose_fields(message: Any) -> Any:
    """What is a geometry_msgs/msg/Pose in a message of one of ``TYPES``."""
    if hasattr(message, "transform"):
        transform = message.transform
        return SimpleNamespace(position=transform.translation, orientation=transform.rotation)
    return getattr(message.pose, "pose", message.pose)


def _covariance(message: Any, pose: gtsam.Pose3) -> np.ndarray | None:
    """Tangent covariance where the message has one."""
    covariance = getattr(getattr(message, "pose", None), "covariance", None)
    if covariance is None:
        return None
    ros = np.asarray(covariance, dtype=np.float64).reshape(6, 6)
    return tangent_from_ros(ros, pose.rotation()) if is_known(ros) else None
