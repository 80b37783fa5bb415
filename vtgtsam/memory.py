# SPDX-License-Identifier: MIT
r"""What an estimator remembers: the last posterior, and for how long vision has been refused.

Before a frame the last posterior is widened by the motion of the present mode and enters as one more factor,

    n/2 ||Log(T_ho(t-1)^-1 T_ho)||^2_Lambda,    Lambda = (M(t-1)^-1 + Q_mode(dt))^-1,

n times as heavy since the frame's own terms count as one of n that say the same (``modes``).
"""

from __future__ import annotations

from typing import NamedTuple

import gtsam
import numpy as np

from .config import EstimatorConfig, ModeSettings
from .factors.motion import motion_factor, widened
from .frame import Frame
from .knowledge import FrameInformation, Knowledge, fused
from .modes import Mode, ModeFilter, random_walk, repetitions


class Belief(NamedTuple):
    """What is believed after a frame.

    Attributes:
        time: The frame's instant [s].
        T_ho: Pose of the object in the hand.
        knowledge: How sure that is.
    """

    time: float
    T_ho: gtsam.Pose3
    knowledge: Knowledge


class Expectation(NamedTuple):
    """What the frames before say about the pose now.

    Attributes:
        mode: How the object moves in the hand.
        before: What was believed after the last frame; None in a first one.
        spread: How the pose may have moved since, a covariance (6, 6).
        information: Lambda, about ``before.T_ho`` now, shape (6, 6).
        repetitions: n, as one of how many frames that say the same this one counts.
    """

    mode: Mode
    before: Belief | None
    spread: np.ndarray
    information: np.ndarray
    repetitions: float

    def factor(self, key: int) -> gtsam.PriorFactorPose3:
        """The motion factor on the pose ``key``."""
        assert self.before is not None
        return motion_factor(key, self.before.T_ho, self.repetitions * self.information)

    def posterior(self, frame: FrameInformation) -> Knowledge:
        """What is known after a frame that says so much."""
        if self.before is None:
            return fused(frame)
        return fused(frame, self.information, self.before.knowledge, self.spread, self.repetitions)

    def forgotten(self) -> Expectation:
        """The same frame without what was before."""
        return self._replace(before=None)


class Memory:
    """Carries the belief from frame to frame.

    Args:
        config: Modes and the restart rule.

    Attributes:
        belief: What is believed after the last frame; None before the first.
    """

    def __init__(self, config: EstimatorConfig) -> None:
        self._config = config
        self._modes = ModeFilter(config)
        self._refused_since: float | None = None
        self.belief: Belief | None = None

    def expect(self, frame: Frame) -> Expectation:
        """What to expect of a frame before it is solved."""
        mode = self._modes.mode(frame.time, frame.touching, frame.T_hp)
        settings: ModeSettings = getattr(self._config, mode)
        before = self.belief
        if before is None:
            return Expectation(mode, None, np.zeros((6, 6)), np.zeros((6, 6)), 1.0)
        dt = max(0.0, frame.time - before.time)
        spread = random_walk(settings, dt)
        information = before.knowledge.information
        if dt > 0.0:
            information = widened(information, spread)
        return Expectation(mode, before, spread, information, repetitions(settings, dt))

    def refuses(self, frame: Frame, visual_weight: float) -> bool:
        """Whether vision has been refused for so long that it may be right after all."""
        if frame.T_ho_visual is None:
            return False  # it says nothing: neither refused nor believed
        if visual_weight >= self._config.refused_weight:
            self._refused_since = None
            return False
        if self._refused_since is None:
            self._refused_since = frame.time
        return (
            not frame.touching.any()
            or frame.time - self._refused_since >= self._config.restart_after
        )

    def keep(self, time: float, T_ho: gtsam.Pose3, knowledge: Knowledge) -> None:
        """Believe this from now on."""
        self.belief = Belief(time, T_ho, knowledge)

    def restarted(self) -> None:
        """Vision has taken over: it is not refused any more."""
        self._refused_since = None
