# SPDX-License-Identifier: MIT
"""What every visual tracker of this project looks like from outside.

A tracker of one's own (FoundationPose in the loop, a marker, ...) that has these two methods takes the
place of ``DepthTracker`` anywhere; it need not inherit from anything here.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, Protocol, runtime_checkable

import gtsam
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@dataclass(frozen=True, eq=False)
class TrackedPose:
    """What a visual tracker reports for one image.

    Attributes:
        T_wo: The object's pose in the world, None while lost.
        covariance: Covariance of a right perturbation of ``T_wo``, [rotation, translation], shape
            (6, 6) [rad, m]; inf on the diagonal while lost.
        visible_fraction: Share of the object's outline in which its surface was really seen, in
            [0, 1]: low when it is covered, or when the pose is wrong.
        status: "ok", or "lost" where the images no longer tell the pose.
        correlation: How long the errors of its poses stay alike [s]; 0 where each image errs by itself. A pose that
            is a mean over some images has their errors for as long, though its covariance is smaller.
    """

    T_wo: gtsam.Pose3 | None
    covariance: np.ndarray
    visible_fraction: float
    status: Literal["ok", "lost"]
    correlation: float = 0.0

    @classmethod
    def lost(cls, visible_fraction: float = 0.0) -> TrackedPose:
        """Nothing is known."""
        return cls(None, np.diag(np.full(6, np.inf)), visible_fraction, "lost")


@runtime_checkable
class VisualTracker(Protocol):
    """Follows one object through the images of one camera.

    One that makes use of a stereo camera's infrared images takes them as ``infrared``, a further argument of
    ``update``; it is passed to trackers of this project alone.
    """

    def start(self, T_wo: gtsam.Pose3) -> None:
        """Begin a sequence at the pose of its first frame, forgetting everything before."""
        ...

    def update(
        self,
        depth: np.ndarray,
        T_wc: gtsam.Pose3,
        joints: ArrayLike | Mapping[str, float] | None = None,
        T_wh: gtsam.Pose3 | None = None,
    ) -> TrackedPose:
        """The pose in the next image.

        Args:
            depth: Depth image [m], shape (height, width), 0 where nothing was measured.
            T_wc: Pose of the camera in the world.
            joints: Joint angles of the hand [rad], for trackers that know the hand.
            T_wh: Pose of the hand's root frame in the world, for the same.
        """
        ...
