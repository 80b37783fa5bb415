# SPDX-License-Identifier: MIT
"""Is the visual tracker alive? Poses that repeat, that jump, that are in millimetres, or that touch denies."""

from __future__ import annotations

from typing import TYPE_CHECKING

import gtsam
import numpy as np

from ..frame import Frame
from ..sdf.grid import GridSdf
from .lasting import Lasting
from .words import VISION_FAR, VISION_JUMPS, VISION_MILLIMETRES, VISION_REPEATS

if TYPE_CHECKING:
    from ..calibration.change import Change

REPEATED = (
    0.2  # [s], a tracker whose numbers stay the same to the last digit for so long has stopped
)
FAR_AWAY = 5.0  # [m] from the hand: no object that it holds
WITHIN_REACH = 1.5  # [m] from the hand, after metres were made of millimetres
JUMP = 0.04  # [m]
TURN = np.deg2rad(60.0)  # [rad]
TOGETHER = 0.2  # [s], poses further apart in time do not jump, they go on
NAMED_FOR = 0.7  # [s], for how long a jump is named: longer than it takes vision to take over
TOUCHED = 0.01  # [m], a touching pad that is farther away than this touches something else
DENIED = 0.15  # [s]


class VisionWatch:
    """Watches the visual poses.

    Args:
        sdf: The object's distance field.

    Attributes:
        suspect: Whether vision has jumped away from where it was believed while pads touched, and has not been
            believed since: what is held does not jump.
    """

    def __init__(self, sdf: GridSdf) -> None:
        self._sdf = sdf
        self._last: tuple[float, gtsam.Pose3, gtsam.Pose3] | None = None  # time, T_wo, T_ho
        self._repeats = Lasting(REPEATED)
        self._far = Lasting(DENIED)
        self._jumped = -np.inf
        self.suspect = self._believed = False

    def alone(self, frame: Frame) -> tuple[Frame, tuple[str, ...]]:
        """The frame, without a visual pose that cannot be one by itself, and what is wrong."""
        if frame.T_wo_visual is None or not self._in_millimetres(frame):
            return frame, ()
        return _unseen(frame), (VISION_MILLIMETRES,)

    def recalibrate(self, change: Change) -> None:
        """Have seen everything with another calibration."""
        if self._last is not None:
            time, T_wo, T_ho = self._last
            moved = change.pose(T_wo)
            self._last = time, moved, T_ho.compose(T_wo.between(moved))

    def before(self, frame: Frame) -> tuple[Frame, tuple[str, ...]]:
        """The frame, without a visual pose that repeats the ones before, and what is wrong."""
        if frame.T_ho_visual is None or frame.T_wo_visual is None:
            return frame, self._named(frame.time)
        same = self._last is not None and frame.T_wo_visual.equals(self._last[1], 1e-12)
        if self._last is not None and not same and self._jumps(frame):
            self._jumped = frame.time
            self.suspect |= self._believed and bool(frame.touching.any())
        self._last = frame.time, frame.T_wo_visual, frame.T_ho_visual
        if self._repeats.holds(frame.time, same):
            return _unseen(frame), (*self._named(frame.time), VISION_REPEATS)
        return frame, self._named(frame.time)

    def after(
        self, frame: Frame, refused: bool, touching: np.ndarray, points_h: np.ndarray
    ) -> tuple[str, ...]:
        """What touch says of a visual pose that was refused.

        Args:
            frame: The frame.
            refused: Whether its visual pose was refused.
            touching: Which pads report contact, shape (K,).
            points_h: Their closest points in the hand [m], shape (K, 3).
        """
        if frame.T_ho_visual is not None:
            self._believed = not refused
            self.suspect &= refused
        denied = False
        if refused and frame.T_ho_visual is not None and np.count_nonzero(touching) > 1:
            points_o = frame.T_ho_visual.transformTo(points_h[touching].T).T
            denied = bool((np.abs(self._sdf.value(points_o)) > TOUCHED).all())
        if frame.T_ho_visual is None:
            return ()
        return (VISION_FAR,) if self._far.holds(frame.time, denied) else ()

    def jumped_lately(self, time: float) -> bool:
        """Whether vision has jumped within the last half second."""
        return time - self._jumped <= NAMED_FOR

    def _named(self, time: float) -> tuple[str, ...]:
        return (VISION_JUMPS,) if self.jumped_lately(time) else ()

    def _in_millimetres(self, frame: Frame) -> bool:
        assert frame.T_wo_visual is not None
        hand, seen = frame.T_wh.translation(), frame.T_wo_visual.translation()
        if np.linalg.norm(seen - hand) < FAR_AWAY:
            return False
        return bool(np.linalg.norm(seen / 1000.0 - hand) < WITHIN_REACH)

    def _jumps(self, frame: Frame) -> bool:
        assert self._last is not None and frame.T_ho_visual is not None
        time, _, T_ho = self._last
        if frame.time - time > TOGETHER:
            return False
        step = T_ho.between(frame.T_ho_visual)
        angle = np.linalg.norm(gtsam.Rot3.Logmap(step.rotation()))
        return bool(np.linalg.norm(step.translation()) > JUMP or angle > TURN)


def _unseen(frame: Frame) -> Frame:
    return frame._replace(T_ho_visual=None, visual_covariance=None)
