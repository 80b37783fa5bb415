# SPDX-License-Identifier: MIT
"""Poses from /tf: the chain of transforms between two frames, whenever one of its links is sent."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import gtsam

from ..recording import messages
from ..recording.poses import pose_fields
from .intake import Intake


class TransformTree:
    """The newest transform of each frame to its parent."""

    def __init__(self) -> None:
        self._links: dict[str, tuple[str, gtsam.Pose3, int]] = {}  # parent, pose, stamp, by child

    def update(self, message: Any) -> set[str]:
        """Take a tf2_msgs/msg/TFMessage; the frames that it moved. What is no transform in it is left out."""
        moved = set()
        for transform in message.transforms:
            pose = messages.pose_from_fields(pose_fields(transform))
            child, parent = _plain(transform.child_frame_id), _plain(transform.header.frame_id)
            if pose is not None and child and parent and child != parent:
                self._links[child] = (parent, pose, messages.stamp_ns(transform))
                moved.add(child)
        return moved

    def pose(self, frame: str, child: str) -> tuple[int, gtsam.Pose3, set[str]] | None:
        """The pose of ``child`` in ``frame``; None where it is not known.

        Returns:
            Its newest stamp [ns], the pose, and the frames between them.
        """
        T, stamp_ns = gtsam.Pose3(), 0
        between: set[str] = set()
        here, there = _plain(child), _plain(frame)
        while here != there:
            link = self._links.get(here)
            if link is None or here in between:  # unknown, or a loop
                return None
            between.add(here)
            here, pose, link_ns = link
            T, stamp_ns = pose.compose(T), max(stamp_ns, link_ns)
        return stamp_ns, T, between


def _plain(frame: str) -> str:
    return frame.lstrip("/")


def tf_intakes(
    wanted: Mapping[str, tuple[Sequence[str], Callable[[int, gtsam.Pose3], bool]]],
) -> dict[str, Intake]:
    """What takes /tf and /tf_static; none where no pose comes from there.

    Args:
        wanted: For each pose the two frames, and what takes the stamp [ns] and the pose.
    """
    if not wanted:
        return {}
    tree = TransformTree()

    def take(message: Any) -> None:
        moved = tree.update(message)
        for (frame, child), put in wanted.values():
            found = tree.pose(frame, child)
            if found is not None and found[2] & moved:
                put(found[0], found[1])

    return {
        topic: Intake(topic, ("tf2_msgs/msg/TFMessage",), take) for topic in ("/tf", "/tf_static")
    }
