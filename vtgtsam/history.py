# SPDX-License-Identifier: MIT
"""The last half second of frames: where a visual pose that comes late is fused, at its own instant.

An image is taken, sent and tracked before its pose arrives, and the hand has moved since. The frame of the image's
instant is solved again with the pose in it, from what was believed before it, and so are all frames after it. Their
hands' factors stay linearized while they move little (``relinearize``).
"""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING, NamedTuple

import gtsam
import numpy as np

from .covariance import ROUNDING
from .frame import Frame
from .knowledge import FrameInformation
from .memory import Belief
from .modes import Mode

if TYPE_CHECKING:
    from .calibration.change import Change

KEPT = 0.5  # [s]
SAME = 1e-3  # [s], instants that are closer are the same frame's


class LinearizedHand(NamedTuple):
    """The factors of a frame's hand, linearized.

    Attributes:
        T_ho: Where.
        says: What they say of the pose there.
    """

    T_ho: gtsam.Pose3
    says: FrameInformation

    def factor(self, key: int) -> gtsam.LinearContainerFactor:
        """They as one factor on the object's pose ``key``; nothing along what they do not measure."""
        eigenvalues, vectors = np.linalg.eigh(self.says.information)
        known = eigenvalues > ROUNDING * eigenvalues[-1]
        root, along = np.sqrt(eigenvalues[known]), vectors[:, known].T
        R, b = root[:, None] * along, -(along @ self.says.gradient) / root
        there = gtsam.Values()
        there.insert(key, pose3=self.T_ho)
        linear = gtsam.JacobianFactor(key, R, b, gtsam.noiseModel.Unit.Create(len(b)))
        return gtsam.LinearContainerFactor(linear, there)


class Past(NamedTuple):
    """A frame, and what was believed before and after it.

    Attributes:
        frame: The frame.
        mode: How the object moved in the hand.
        before: What was believed before it.
        after: What was believed after it; None where it was not solved.
        hand: What its hand said where it was solved; None where it was not.
    """

    frame: Frame
    mode: Mode
    before: Belief | None
    after: Belief | None = None
    hand: LinearizedHand | None = None


class History:
    """Frames in the order of their instants, none older than ``KEPT`` before the last."""

    def __init__(self) -> None:
        self._past: deque[Past] = deque()

    def append(self, past: Past) -> None:
        """Remember a frame, which is not earlier than the last one."""
        self._past.append(past)
        while self._past[0].frame.time < past.frame.time - KEPT:
            self._past.popleft()

    def at_its_instant(self, frame: Frame, visual_time: float) -> Frame | None:
        """The frame with its visual pose at the instant of its image [s]; None where the hand of then is forgotten."""
        if frame.T_ho_visual is None or not visual_time >= frame.time - KEPT:
            return None
        T_wh = self._hand_at(visual_time, frame)
        if T_wh is None:
            return None
        seen = T_wh.between(frame.T_wh.compose(frame.T_ho_visual))
        return frame._replace(time=visual_time, T_wh=T_wh, T_ho_visual=seen)

    def _hand_at(self, time: float, now: Frame) -> gtsam.Pose3 | None:
        """Where the hand was at an instant [s], between its poses before and after; None where that is forgotten."""
        after_time, after = now.time, now.T_wh
        for past in reversed(self._past):
            if past.frame.time <= time:
                span = after_time - past.frame.time
                share = (time - past.frame.time) / span if span > 0.0 else 0.0
                T_wh: gtsam.Pose3 = past.frame.T_wh.slerp(share, after)
                return T_wh
            after_time, after = past.frame.time, past.frame.T_wh
        return None

    def recalibrate(self, change: Change) -> None:
        """Have the frames as they would have been with another calibration."""
        for past in list(self._past):
            self._past.popleft()
            before = None if past.before is None else change.belief(past.before)
            self._past.append(Past(change.frame(past.frame), past.mode, before))

    def rewind(self, late: Frame, now: Belief | None) -> list[Past]:
        """Take out the frames from a late one's instant on, the late visual pose in its place among them.

        Args:
            late: A visual pose and where the hand was at its instant; contacts and joints are not used.
            now: What is believed after the last frame.

        Returns:
            The frames to solve again, in order; the first has what was believed before it.
        """
        again: list[Past] = []
        while self._past and self._past[-1].frame.time > late.time - SAME:
            again.insert(0, self._past.pop())
        if again and abs(again[0].frame.time - late.time) <= SAME:
            seen = again[0].frame._replace(
                T_ho_visual=late.T_ho_visual,
                visual_covariance=late.visual_covariance,
                visual_correlation=late.visual_correlation,
                suspect=late.suspect,
            )
            again[0] = again[0]._replace(frame=seen)
        elif self._past:  # between two frames: contacts and joints as in the one before
            last = self._past[-1]
            earlier = last.frame
            between = earlier._replace(
                time=late.time,
                T_wh=late.T_wh,
                T_ho_visual=late.T_ho_visual,
                visual_covariance=late.visual_covariance,
                visual_correlation=late.visual_correlation,
                suspect=late.suspect,
            )
            mode = again[0].mode if again else last.mode
            before = again[0].before if again else now
            again.insert(0, Past(between, mode, before, hand=last.hand))
        return again
