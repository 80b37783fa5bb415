# SPDX-License-Identifier: MIT
"""Poses at instants, and the pose between two of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import gtsam
import numpy as np

MAX_GAP_S = 0.5  # [s], poses further apart than this say nothing about what was between them
STAMP_ROUNDING_S = 1e-6  # [s], nanoseconds since 1970 as a float are good to 0.2 us


@dataclass(frozen=True, eq=False)
class PoseTrajectory:
    """Poses in the order of their instants; unpacks as ``times, poses = trajectory``.

    Attributes:
        times: Instants [s], shape (N,), increasing.
        poses: The N poses.
    """

    times: np.ndarray
    poses: Sequence[gtsam.Pose3]

    def __iter__(self) -> Iterator[np.ndarray | Sequence[gtsam.Pose3]]:
        yield self.times
        yield self.poses

    def __len__(self) -> int:
        return len(self.poses)

    def at(self, times: Sequence[float] | np.ndarray) -> list[gtsam.Pose3 | None]:
        """Poses at other instants [s].

        Between two poses the translation is interpolated linearly and the rotation along the shorter
        way. None before the first, after the last, and in gaps above 0.5 s.
        """
        return [self._at(float(time)) for time in times]

    def _at(self, time: float) -> gtsam.Pose3 | None:
        after = int(np.searchsorted(self.times, time - STAMP_ROUNDING_S))
        if after == len(self.times):
            return None
        if abs(self.times[after] - time) <= STAMP_ROUNDING_S:
            return self.poses[after]
        if after == 0 or self.times[after] - self.times[after - 1] > MAX_GAP_S:
            return None
        t0, t1 = self.times[after - 1 : after + 1]
        return interpolate(self.poses[after - 1], self.poses[after], (time - t0) / (t1 - t0))


def interpolate(start: gtsam.Pose3, end: gtsam.Pose3, share: float) -> gtsam.Pose3:
    """The pose at a share in [0, 1] of the way from one pose to another."""
    translation = (1 - share) * start.translation() + share * end.translation()
    return gtsam.Pose3(start.rotation().slerp(share, end.rotation()), translation)
