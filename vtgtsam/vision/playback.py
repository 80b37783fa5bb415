# SPDX-License-Identifier: MIT
"""Poses from files in the place of a tracker."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Literal

import gtsam
import numpy as np

from ..recording.pose_files import PoseFiles
from .tracker import TrackedPose

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

IMAGE_TOLERANCE_NS = 10**6  # [ns], a stamp this near to an image's is the image's


class Playback:
    """A ``VisualTracker`` that has its answers already; it looks at no image.

    Args:
        poses: What to report for each image in turn, None where the object was not found.
        frame: Whether they are T_wo ("world") or T_co ("camera").
    """

    def __init__(
        self, poses: Sequence[gtsam.Pose3 | None], frame: Literal["world", "camera"]
    ) -> None:
        self._poses, self._frame = poses, frame
        self._next = 0

    @classmethod
    def of_files(cls, files: PoseFiles, image_times: Sequence[float] | np.ndarray) -> Playback:
        """A tracker that reports the poses in files, image by image.

        Args:
            files: The poses.
            image_times: Instants of the images that it will be given [s], in their order.
        """
        instants = np.rint(np.asarray(image_times, dtype=np.float64) * 1e9).astype(np.int64)
        times, poses = files.times_ns(image_times), files.poses
        reported: list[gtsam.Pose3 | None] = []
        for instant in instants:
            nearest = int(np.argmin(np.abs(times - instant)))
            near = abs(int(times[nearest]) - int(instant)) <= IMAGE_TOLERANCE_NS
            reported.append(poses[nearest] if near else None)
        return cls(reported, files.frame)

    def start(self, T_wo: gtsam.Pose3) -> None:
        """Begin again at the first image; where the object is, the files say."""
        self._next = 0

    def update(
        self,
        depth: np.ndarray,
        T_wc: gtsam.Pose3,
        joints: ArrayLike | Mapping[str, float] | None = None,
        T_wh: gtsam.Pose3 | None = None,
    ) -> TrackedPose:
        """The pose in the next image, lost after the last; covariance and visible part are NaN, unknown."""
        index, self._next = self._next, self._next + 1
        pose = self._poses[index] if index < len(self._poses) else None
        if pose is None:
            return TrackedPose.lost()
        T_wo = pose if self._frame == "world" else T_wc * pose
        return TrackedPose(T_wo, np.full((6, 6), np.nan), float("nan"), "ok")
