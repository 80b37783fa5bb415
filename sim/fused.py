# SPDX-License-Identifier: MIT
"""What the estimator makes of a sequence while it is recorded, for a tracker that is handed fused poses back."""

from __future__ import annotations

from typing import TYPE_CHECKING

import gtsam
import numpy as np

from vtgtsam import Measurement, PoseEstimator
from vtgtsam.vision.hand_back import HandBack, Searches
from vtgtsam.vision.tracker import TrackedPose

if TYPE_CHECKING:
    from .record import Take


class FusedLoop:
    """Fuses each frame as a robot would, and hands the pose back to the tracker.

    Args:
        take: The sequence as its sensors have it.
        tracker: The tracker to tell.
    """

    def __init__(self, take: Take, tracker: Searches) -> None:
        self._take = take
        self._estimator = PoseEstimator(take.world.hand, take.world.obj)
        self._hand_back = HandBack(tracker)

    def after(self, k: int, tracked: TrackedPose) -> None:
        """Fuse frame k with what the tracker reports for it."""
        t = self._take.trajectory
        time = float(t.frame_time[k])
        sample = np.searchsorted(t.time, time + 1e-9, side="right") - 1  # the last one until then
        seen = tracked.T_wo is not None
        estimate = self._estimator.update(
            Measurement(
                time=time,
                contacts=t.contacts[sample],
                joints=self._take.measured_joints(t.joints[sample]),
                T_wh=gtsam.Pose3(t.T_wh[sample]),
                T_wo_visual=tracked.T_wo,
                visual_covariance=tracked.covariance if seen else None,
                visual_correlation=tracked.correlation,
            )
        )
        self._hand_back.after(estimate)
