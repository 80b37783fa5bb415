# SPDX-License-Identifier: MIT
"""Visual poses on their way into frames: late, out of order, several at once.

A pose belongs to the instant of its image and comes when the tracker has found it, so that it is fused in a frame that
is later. Each frame takes one, in the order in which they became known. A live run and the replay of its recording
use this same queue, so that each pose counts in the same frame.
"""

from __future__ import annotations

from collections import deque
from dataclasses import dataclass

import gtsam
import numpy as np

WAITING = 2  # poses that wait; a tracker that is faster than the frames loses its older ones


@dataclass(frozen=True, eq=False)
class VisualPose:
    """What the tracker saw.

    Attributes:
        stamp_ns: Instant of the image [ns].
        T_wo: The object's pose.
        covariance: Its covariance, right perturbation, rotation first, shape (6, 6); None where not given.
        correlation: How long its errors stay alike [s].
    """

    stamp_ns: int
    T_wo: gtsam.Pose3
    covariance: np.ndarray | None = None
    correlation: float = 0.0


class VisionQueue:
    """Visual poses that no frame has taken yet.

    Args:
        hold_ns: How long after its image a pose counts again in frames that have no newer one [ns]. An estimator with
            memory needs each once, 0; one without would be blind between two images.

    Attributes:
        refused: Poses whose image had been there already.
        passed_over: Poses that no frame took, since newer ones came too fast.
    """

    def __init__(self, hold_ns: int = 0) -> None:
        self._hold_ns = hold_ns
        self._waiting: deque[VisualPose] = deque()
        self._stamps: deque[int] = deque(maxlen=64)
        self._last: VisualPose | None = None
        self.latest_ns: int | None = None
        self.refused = 0
        self.passed_over = 0

    def put(self, pose: VisualPose) -> bool:
        """Whether its image is a new one, and the pose was taken; it may be older than the last."""
        if pose.stamp_ns in self._stamps:
            self.refused += 1
            return False
        self._stamps.append(pose.stamp_ns)
        self._waiting.append(pose)
        self.latest_ns = max(pose.stamp_ns, self.latest_ns or pose.stamp_ns)
        if len(self._waiting) > WAITING:
            self._waiting.popleft()
            self.passed_over += 1
        return True

    def waiting(self, instant_ns: int) -> list[VisualPose]:
        """The poses that wait, of images up to an instant."""
        return [pose for pose in self._waiting if pose.stamp_ns <= instant_ns]

    def begin(self, stamp_ns: int) -> VisualPose | None:
        """The waiting pose of that image, for the first frame; what came before it is forgotten."""
        if all(pose.stamp_ns != stamp_ns for pose in self._waiting):
            return None
        while (pose := self._waiting.popleft()).stamp_ns != stamp_ns:
            pass
        self._last = pose
        return pose

    def again(self) -> None:
        """The last pose that was taken waits once more, where no other does."""
        if self._last is not None and not self._waiting:
            self._waiting.append(self._last)

    def take(self, instant_ns: int) -> VisualPose | None:
        """The pose that the frame of an instant fuses; None where there is none."""
        for pose in self.waiting(instant_ns)[:1]:
            self._waiting.remove(pose)
            self._last = pose
            return pose
        last = self._last
        if last is not None and instant_ns - last.stamp_ns <= self._hold_ns:
            return last
        return None
