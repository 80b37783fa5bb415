# SPDX-License-Identifier: MIT
"""What began in a frame: the object was grasped, slips in the hand, or was dropped."""

from __future__ import annotations

from collections import deque
from typing import Literal

import gtsam
import numpy as np

from ..covariance import LEVER
from ..modes import Mode
from .lasting import Lasting

Event = Literal["grasped", "slipping", "dropped"]

SETTLED = 0.2  # [s], a mode that lasts so long is no flicker
SLIP_WITHIN = 0.5  # [s]
SLIP = 0.004  # [m], way in the hand within that time, a radian counted as ``LEVER``


class EventWatch:
    """Watches modes and the pose in the hand."""

    def __init__(self) -> None:
        self._held = Lasting(SETTLED)
        self._free = Lasting(SETTLED / 2)
        self._in_hand = False
        self._slipping = False
        self._past: deque[tuple[float, gtsam.Pose3]] = deque()

    def after(self, time: float, mode: Mode, T_ho: gtsam.Pose3) -> tuple[Event, ...]:
        """The events that begin at an instant [s]."""
        events: list[Event] = []
        if self._held.holds(time, mode == "held") and not self._in_hand:
            self._in_hand = True
            self._past.clear()
            events.append("grasped")
        if self._free.holds(time, mode == "free") and self._in_hand:
            self._in_hand = self._slipping = False
            events.append("dropped")
        slipping = self._in_hand and self._moves(time, T_ho)
        if slipping and not self._slipping:
            events.append("slipping")
        self._slipping = slipping
        return tuple(events)

    def _moves(self, time: float, T_ho: gtsam.Pose3) -> bool:
        """Whether the pose in the hand has changed by more than a slip within its time."""
        self._past.append((time, T_ho))
        while self._past[0][0] < time - SLIP_WITHIN:
            self._past.popleft()
        step = self._past[0][1].between(T_ho)
        angle = np.linalg.norm(gtsam.Rot3.Logmap(step.rotation()))
        return bool(np.hypot(np.linalg.norm(step.translation()), LEVER * angle / 2) > SLIP)
