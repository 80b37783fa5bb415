# SPDX-License-Identifier: MIT
"""Poses at instants, and the pose between two of them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import overload

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

    @overload
    def at(self, times: float) -> gtsam.Pose3 | None: ...

    @overload
    def at(self, times: Sequence[float] | np.ndarray) -> list[gtsam.Pose3 | None]: ...

    def at(
        self, times: float | Sequence[float] | np.ndarray
    ) -> gtsam.Pose3 | list[gtsam.Pose3 | None] | None:
        """Poses at other instants [s]: one for a number, a list for several.

        Between two poses the translation is interpolated linearly and the rotation along the shorter
        way. None before the first, after the last, in gaps above 0.5 s, and at NaN.

        Raises:
            ValueError: The instants are no numbers.
        """
        instants = np.asarray(times)
        if instants.dtype.kind not in "fiu" or instants.ndim > 1:
            raise ValueError(
                f"instants [s] must be a number or a sequence of numbers, got {type(times).__name__}"
            )
        found = [self._at(time) for time in np.atleast_1d(instants).tolist()]
        return found if instants.ndim else found[0]

    def _at(self, time: float) -> gtsam.Pose3 | None:
        if not np.isfinite(time):
            return None
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
