# SPDX-License-Identifier: MIT
"""Are the hand's joints those of now? Angles out of range or in degrees, and a hand that is frozen."""

from __future__ import annotations

from typing import TYPE_CHECKING

import gtsam
import numpy as np

from ..frame import Frame
from ..hands.pads import PadSet
from .lasting import Lasting
from .words import HAND_FROZEN, JOINTS_DEGREES, JOINTS_OUT_OF_RANGE

if TYPE_CHECKING:
    from ..calibration.change import Change

BEYOND = 0.35  # [rad] or [m], beyond a joint's limits: more than a zero that is off
DEGREES = 7.0  # no joint of a hand turns by more than a turn [rad]
SEEN_MOVING = 0.010  # [m], more than trackers jitter
SEEN_TURNING = np.deg2rad(10.0)  # [rad]
SEEN_FOR = 0.2  # [s]
ROUNDING = 1e-12  # [m], of pads that a calibration has moved


class HandWatch:
    """Watches joints and the hand's pose.

    Args:
        hand: The hand; one without kinematics has no joints to watch.
    """

    def __init__(self, hand: PadSet) -> None:
        model = getattr(hand, "model", None)
        self._range = None
        if model is not None:
            limited = model.jnt_limited.astype(bool)
            lower = np.where(limited, model.jnt_range[:, 0], -np.inf)
            upper = np.where(limited, model.jnt_range[:, 1], np.inf)
            self._range = lower - BEYOND, upper + BEYOND
        self._still: Frame | None = None  # since then the hand's numbers are the same
        self._seen: gtsam.Pose3 | None = None  # the visual pose then
        self._moves = Lasting(SEEN_FOR)

    def recalibrate(self, change: Change) -> None:
        """Have seen everything with another calibration."""
        self._still = None if self._still is None else change.frame(self._still)
        self._seen = None if self._seen is None else change.pose(self._seen)

    def alone(self, frame: Frame) -> tuple[Frame, tuple[str, ...]]:
        """The frame, without pads by joints that no such hand has, and what is wrong."""
        return _without_pads(frame, self._out_of_range(frame.joints))

    def before(self, frame: Frame, vision_jumped: bool) -> tuple[Frame, tuple[str, ...]]:
        """The frame, without pads that are no longer there, and what is wrong."""
        if not frame.pads_known:
            return frame, ()
        return _without_pads(frame, self._frozen(frame, vision_jumped))

    def _out_of_range(self, joints: np.ndarray | None) -> str | None:
        if joints is None or self._range is None:
            return None
        lower, upper = self._range
        if ((joints >= lower) & (joints <= upper)).all():
            return None
        return JOINTS_DEGREES if np.abs(joints).max() > DEGREES else JOINTS_OUT_OF_RANGE

    def _frozen(self, frame: Frame, vision_jumped: bool) -> str | None:
        """Whether the hand's numbers have not changed in any digit while the object is seen moving."""
        if self._still is None or not _same_hand(frame, self._still):
            self._still, self._seen = frame, frame.T_wo_visual
            self._moves.holds(frame.time, False)
            return None
        if self._seen is None or vision_jumped:
            self._seen = frame.T_wo_visual
        if self._seen is None or frame.T_wo_visual is None:
            return None
        moved = self._seen.between(frame.T_wo_visual)
        angle = np.linalg.norm(gtsam.Rot3.Logmap(moved.rotation()))
        seen = np.linalg.norm(moved.translation()) > SEEN_MOVING or angle > SEEN_TURNING
        return HAND_FROZEN if self._moves.holds(frame.time, bool(seen)) else None


def _without_pads(frame: Frame, fault: str | None) -> tuple[Frame, tuple[str, ...]]:
    return (frame, ()) if fault is None else (frame.without_pads(), (fault,))


def _same_hand(a: Frame, b: Frame) -> bool:
    same_pads = np.abs(a.T_hp - b.T_hp).max() < ROUNDING
    return bool(same_pads) and a.T_wh.equals(b.T_wh, 0.0)
