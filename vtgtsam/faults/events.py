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
PINCH = 2  # touching pads that hold an object if they keep touching
PINCHED = 1.0  # [s], so long
SLIP_WITHIN = 0.5  # [s]
SLIP = 0.004  # [m], way in the hand within that time, a radian counted as half ``LEVER``
SURE = 2.5  # sigmas of the pose along that way, which it must exceed as well
_METRES = np.array([LEVER / 2] * 3 + [1.0] * 3)  # to a way in metres


class EventWatch:
    """Watches modes and the pose in the hand."""

    def __init__(self) -> None:
        self._held = Lasting(SETTLED)
        self._pinched = Lasting(PINCHED)
        self._free = Lasting(SETTLED / 2)
        self._in_hand = False
        self._slipping = False
        self._past: deque[tuple[float, gtsam.Pose3]] = deque()

    def after(
        self, time: float, mode: Mode, touching: int, T_ho: gtsam.Pose3, covariance: np.ndarray
    ) -> tuple[Event, ...]:
        """The events that begin at an instant [s], with so many pads touching, of a pose and its covariance (6, 6)."""
        events: list[Event] = []
        held = self._held.holds(time, mode == "held")
        pinched = self._pinched.holds(time, touching >= PINCH)
        if (held or pinched) and not self._in_hand:
            self._in_hand = True
            self._past.clear()
            events.append("grasped")
        if self._free.holds(time, mode == "free") and self._in_hand:
            self._in_hand = self._slipping = False
            events.append("dropped")
        slipping = self._in_hand and self._moves(time, T_ho, covariance)
        if slipping and not self._slipping:
            events.append("slipping")
        self._slipping = slipping
        return tuple(events)

    def _moves(self, time: float, T_ho: gtsam.Pose3, covariance: np.ndarray) -> bool:
        """Whether the pose in the hand has surely changed by more than a slip within its time."""
        self._past.append((time, T_ho))
        while self._past[0][0] < time - SLIP_WITHIN:
            self._past.popleft()
        known = np.isfinite(np.diag(covariance))  # along the others nothing was measured
        step = (_METRES * self._past[0][1].localCoordinates(T_ho))[known]
        way = float(np.linalg.norm(step))
        if way <= SLIP:
            return False
        along = _METRES[known] * step / way
        return bool(way > SURE * np.sqrt(along @ covariance[np.ix_(known, known)] @ along))
