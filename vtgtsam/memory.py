# SPDX-License-Identifier: MIT
r"""What an estimator remembers: the last posterior, and since when vision has been refused.

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
from .modes import Mode, random_walk, repetitions


class Belief(NamedTuple):
    """What is believed after a frame. A value: the estimator can go back to an earlier one.

    Attributes:
        time: The frame's instant [s].
        T_ho: Pose of the object in the hand.
        knowledge: How sure that is; None where nothing is remembered but the pose.
        refused_since: Instant [s] from which on vision has been refused; None where it is believed.
    """

    time: float
    T_ho: gtsam.Pose3
    knowledge: Knowledge | None = None
    refused_since: float | None = None


class Expectation(NamedTuple):
    """What the frames before say about the pose now.

    Attributes:
        T_ho: The last pose.
        before: How sure it was.
        spread: How the pose may have moved since, a covariance (6, 6).
        information: Lambda, about ``T_ho`` now, shape (6, 6).
        repetitions: n, as one of how many frames that say the same this one counts.
    """

    T_ho: gtsam.Pose3
    before: Knowledge
    spread: np.ndarray
    information: np.ndarray
    repetitions: float

    def factor(self, key: int) -> gtsam.PriorFactorPose3:
        """The motion factor on the pose ``key``."""
        return motion_factor(key, self.T_ho, self.repetitions * self.information)

    def posterior(self, frame: FrameInformation) -> Knowledge:
        """What is known after a frame that says so much."""
        return fused(frame, self.information, self.before, self.spread, self.repetitions)


def expectation(
    before: Belief | None, time: float, mode: Mode, config: EstimatorConfig
) -> Expectation | None:
    """What to expect at an instant [s]; None where nothing is remembered."""
    if before is None or before.knowledge is None:
        return None
    settings: ModeSettings = getattr(config, mode)
    dt = time - before.time
    spread = random_walk(settings, dt)
    information = before.knowledge.information
    if dt > 0.0:
        information = widened(information, spread)
    return Expectation(
        before.T_ho, before.knowledge, spread, information, repetitions(settings, dt)
    )


def refused_since(
    before: Belief | None, frame: Frame, visual_weight: float, config: EstimatorConfig
) -> float | None:
    """Instant [s] from which on vision has been refused, this frame included; None where it is believed.

    A frame without a visual pose says nothing: what was so stays so.
    """
    since = None if before is None else before.refused_since
    if frame.T_ho_visual is None:
        return since
    if visual_weight >= config.refused_weight:
        return None
    return frame.time if since is None else since


def may_take_over(frame: Frame, since: float | None, config: EstimatorConfig) -> bool:
    """Whether vision has been refused for so long that it may be right after all; at once where nothing touches."""
    if frame.T_ho_visual is None or since is None:
        return False
    return not frame.touching.any() or frame.time - since >= config.restart_after
