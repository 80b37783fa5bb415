# SPDX-License-Identifier: MIT
r"""From one calibration to the next while an object is being tracked: what was corrected and believed moves along.

With the first calibration's offsets an estimate is off by X (c_true - c) where c are the offsets that were taken off
(``knowledge``: X is its sensitivity). With others, c', it would be elsewhere by

    T_ho' = T_ho Exp(-X (c' - c))

to first order, so that nothing has to be tracked again, and memory says the same of the object as before.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import gtsam
import numpy as np

from ..frame import Frame, Hand
from ..memory import Belief
from .calibration import Calibration

if TYPE_CHECKING:
    from ..hands.pads import PadSet


class Change:
    """What another calibration changes.

    Args:
        hand: The hand, one with joints.
        before: The calibration until now; None: none, measurements were taken as they came.
        now: The calibration from now on; its camera turns about the point about which it did before.
    """

    def __init__(self, hand: PadSet, before: Calibration | None, now: Calibration) -> None:
        self._hand = hand
        zeros_before = np.zeros(len(now.zeros)) if before is None else before.zeros
        taken_off = gtsam.Pose3() if before is None else before.camera_motion
        self._zeros = now.zeros - zeros_before
        self._moved = now.camera_motion.inverse().compose(taken_off)
        about = gtsam.Pose3(gtsam.Rot3(), now.camera_origin)
        camera = about.inverse().compose(self._moved.inverse()).compose(about)
        self._offsets = np.concatenate([gtsam.Pose3.Logmap(camera), self._zeros])

    def pose(self, T_wo_visual: gtsam.Pose3) -> gtsam.Pose3:
        """A visual pose as it is corrected now, from how it was corrected before."""
        return self._moved.compose(T_wo_visual)

    def hand(self, hand: Hand) -> Hand:
        """A hand with the joints of now; as it is where its pads were given, or are not known."""
        from ..hands.model import HandModel  # brings MuJoCo, which a PadSet does without

        if hand.joints is None:
            return hand
        joints = hand.joints - self._zeros
        assert isinstance(self._hand, HandModel)
        return hand._replace(joints=joints, T_hp=self._hand.pad_transforms(joints))

    def frame(self, frame: Frame) -> Frame:
        """A frame as it would have been with the calibration of now."""
        hand = self.hand(Hand(frame.T_wh, frame.T_hp, frame.joints))
        seen = frame.T_wo_visual
        T_ho_visual = None if seen is None else frame.T_wh.between(self.pose(seen))
        return frame._replace(T_hp=hand.T_hp, joints=hand.joints, T_ho_visual=T_ho_visual)

    def belief(self, belief: Belief) -> Belief:
        """What would be believed with the calibration of now."""
        if belief.knowledge is None:
            return belief
        step = -belief.knowledge.sensitivity @ self._offsets
        seen = None if self._offsets.any() else belief.seen  # it was with the other calibration
        return belief._replace(T_ho=belief.T_ho.retract(step), seen=seen)
