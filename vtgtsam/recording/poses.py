# SPDX-License-Identifier: MIT
"""A topic of poses over time."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from types import SimpleNamespace
from typing import Any

import gtsam
import numpy as np

from . import messages
from .covariance import is_known, tangent_from_ros
from .decode import Arrivals, decode, in_order, note
from .source import BagMessage

# Written are the first two; the others are what other people's robots report.
TYPES = (
    messages.POSE,
    messages.POSE_WITH_COVARIANCE,
    "geometry_msgs/msg/TransformStamped",
    "nav_msgs/msg/Odometry",
)


SAME = 1e-9  # [m], of matrix entries too


@dataclass(frozen=True)
class PoseStream:
    """Poses of one topic.

    Attributes:
        times_ns: Stamps [ns], int64, shape (N,), increasing, N > 0.
        poses: The N poses.
        covariances: Of each pose, shape (6, 6), right perturbation, rotation first; None where not given.
        frames: The frames that messages say they are given in, the first one's first.
        received_ns: When each pose became known [ns], int64, shape (N,); None where they did not come as messages.
        arrivals: When all messages of the topic were stamped and received.
        correlations: How long the errors of each pose stay alike [s], shape (N,); None: not at all.
    """

    times_ns: np.ndarray
    poses: Sequence[gtsam.Pose3]
    covariances: Sequence[np.ndarray | None]
    frames: tuple[str, ...] = ()
    received_ns: np.ndarray | None = None
    arrivals: Arrivals | None = None
    correlations: np.ndarray | None = None

    def chosen(self, keep: np.ndarray) -> PoseStream:
        """Those poses for which ``keep`` (N,) is true, at least one."""
        index = np.flatnonzero(keep).tolist()
        return dataclasses.replace(
            self,
            times_ns=self.times_ns[index],
            poses=[self.poses[i] for i in index],
            covariances=[self.covariances[i] for i in index],
            received_ns=None if self.received_ns is None else self.received_ns[index],
            correlations=None if self.correlations is None else self.correlations[index],
        )

    def correlation(self, index: int) -> float:
        """How long the errors of a pose stay alike [s]."""
        return 0.0 if self.correlations is None else float(self.correlations[index])

    @cached_property
    def is_constant(self) -> bool:
        """Whether all poses are one."""
        first = self.poses[0]
        return all(pose.equals(first, SAME) for pose in self.poses[1:])

    def held(self, instants_ns: np.ndarray) -> np.ndarray:
        """Index of the last pose at or before each instant, shape (F,); -1 where there is none.

        A topic with one pose, sent once or several times, says where something is that never moves,
        whenever it came.
        """
        if self.is_constant:
            return np.zeros(len(instants_ns), dtype=np.int64)
        return np.searchsorted(self.times_ns, instants_ns, side="right") - 1


def read_poses(topic: str, bag: Sequence[BagMessage], warnings: list[str]) -> PoseStream | None:
    """The poses of a topic, or None where it has none that can be used."""
    decoded = decode(topic, bag, TYPES, warnings)
    entries = decoded.received
    found: list[tuple[int, gtsam.Pose3, np.ndarray | None, int]] = []
    unusable = 0
    for stamp, message, known in entries:
        pose = messages.pose_from_fields(pose_fields(message))
        if pose is not None:
            covariance, usable = _covariance(message, pose)
            unusable += not usable
            found.append((stamp, pose, covariance, known))
    why = "are not finite or have a quaternion whose norm is not 1"
    note(warnings, topic, len(entries) - len(found), len(entries), why)
    if unusable:
        warnings.append(
            f"topic {topic}: the covariances of {unusable} of {len(found)} poses are not used, they are "
            "singular or no covariance (give every direction a variance above 0); the configured weight "
            "counts in their place"
        )
    found = in_order(found, topic, warnings)
    if not found:
        return None
    stamps, poses, covariances, known_ns = zip(*found, strict=True)
    frames = dict.fromkeys(str(message.header.frame_id) for _, message, _ in entries)
    return PoseStream(
        np.array(stamps, dtype=np.int64),
        poses,
        covariances,
        tuple(frames),
        np.array(known_ns, dtype=np.int64),
        decoded.arrivals,
    )


def with_correlations(
    stream: PoseStream, topic: str, bag: Sequence[BagMessage], warnings: list[str]
) -> PoseStream:
    """Visual poses with how long their errors stay alike, as another topic says it for the same stamps."""
    if not bag:
        return stream
    entries = decode(topic, bag, (messages.CORRELATION_TIME,), warnings).entries
    said = {stamp: m.seconds for stamp, m in entries if 0.0 <= m.seconds < np.inf}
    note(warnings, topic, len(entries) - len(said), len(entries), "are no time of an own stamp")
    correlations = [said.get(stamp, 0.0) for stamp in stream.times_ns.tolist()]
    return dataclasses.replace(stream, correlations=np.array(correlations))


def pose_fields(message: Any) -> Any:
    """What is a geometry_msgs/msg/Pose in a message of one of ``TYPES``."""
    if hasattr(message, "transform"):
        transform = message.transform
        return SimpleNamespace(position=transform.translation, orientation=transform.rotation)
    return getattr(message.pose, "pose", message.pose)


def _covariance(message: Any, pose: gtsam.Pose3) -> tuple[np.ndarray | None, bool]:
    """Tangent covariance where the message has one, and whether what it has can be used."""
    covariance = getattr(getattr(message, "pose", None), "covariance", None)
    if covariance is None:
        return None, True
    ros = np.asarray(covariance, dtype=np.float64).reshape(6, 6)
    if is_known(ros):
        return tangent_from_ros(ros, pose.rotation()), True
    return None, not np.any(ros)  # all zeros: unknown, by ROS's convention
