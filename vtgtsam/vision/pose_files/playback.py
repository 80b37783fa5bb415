# SPDX-License-Identifier: MIT
"""Poses from files in the place of a tracker."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import gtsam
import numpy as np

from ..tracker import TrackedPose
from .formats import Frame

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


class Playback:
    """A ``VisualTracker`` that has its answers already; it looks at no image.

    Args:
        poses: What to report for each image in turn, None where the object was not found.
        frame: Whether they are T_wo ("world") or T_co ("camera").
    """

    def __init__(self, poses: Sequence[gtsam.Pose3 | None], frame: Frame) -> None:
        self._poses, self._frame = poses, frame
        self._next = 0

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
