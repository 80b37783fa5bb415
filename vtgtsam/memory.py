# SPDX-License-Identifier: MIT
r"""What an estimator remembers: the last posterior, and since when vision has been refused.

Before a frame the last posterior is widened by the motion of the present mode and enters as one more factor,

    n/2 ||Log(T_ho(t-1)^-1 T_ho)||^2_Lambda,    Lambda = (M(t-1)^-1 + Q_mode(dt))^-1,

n times as heavy since the frame's own terms count as one of n that say the same (``modes``).

A visual pose whose errors stay alike for tau seconds (``Measurement.visual_correlation``) repeats what memory holds of
the images before, dt seconds ago and earlier. So it counts as one of

    m = max(n, 1 + (tau / dt - 1) s),    s = tr((I + Q_mode M(t-1))^-1) / 6

images, tau / dt of them as far as memory still holds what they said: s is the mean share of what was known that is left
after the motion, 1 of an object that does not move, 0 of one that moves far. Its loss is divided by m / n beside touch.
(Of errors with autocorrelation exp(-t / tau'), N images in a long time T are worth T / (2 tau') independent ones;
Bayley and Hammersley, "The Effective Number of Independent Observations in an Autocorrelated Time Series", 1946. So
tau = 2 tau', the integral of the autocorrelation.)
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
        seen_at: Instant of the last visual pose [s]; None where there has been none.
    """

    time: float
    T_ho: gtsam.Pose3
    knowledge: Knowledge | None = None
    refused_since: float | None = None
    seen_at: float | None = None


class Expectation(NamedTuple):
    """What the frames before say about the pose now.

    Attributes:
        T_ho: The last pose.
        before: How sure it was.
        spread: How the pose may have moved since, a covariance (6, 6).
        information: Lambda, about ``T_ho`` now, shape (6, 6).
        repetitions: n, as one of how many frames that say the same this one counts.
        images_alike: m / n, as one of how many images beside that its visual pose counts.
    """

    T_ho: gtsam.Pose3
    before: Knowledge
    spread: np.ndarray
    information: np.ndarray
    repetitions: float
    images_alike: float = 1.0

    def factor(self, key: int) -> gtsam.PriorFactorPose3:
        """The motion factor on the pose ``key``."""
        return motion_factor(key, self.T_ho, self.repetitions * self.information)

    def posterior(self, frame: FrameInformation) -> Knowledge:
        """What is known after a frame that says so much."""
        return fused(frame, self.information, self.before, self.spread, self.repetitions)


def expectation(
    before: Belief | None, frame: Frame, mode: Mode, config: EstimatorConfig
) -> Expectation | None:
    """What to expect in a frame; None where nothing is remembered."""
    if before is None or before.knowledge is None:
        return None
    settings: ModeSettings = getattr(config, mode)
    dt = frame.time - before.time
    spread = random_walk(settings, dt)
    information = before.knowledge.information
    if dt > 0.0:
        information = widened(information, spread)
    n = repetitions(settings.correlation, dt)
    alike = images_alike(before, frame, spread) / n
    return Expectation(before.T_ho, before.knowledge, spread, information, n, max(1.0, alike))


def images_alike(before: Belief, frame: Frame, spread: np.ndarray) -> float:
    """As one of how many images that err alike a frame's visual pose counts; see above."""
    if frame.visual_correlation == 0.0 or before.seen_at is None or before.knowledge is None:
        return 1.0
    alike = repetitions(frame.visual_correlation, frame.time - before.seen_at)
    left = np.trace(np.linalg.inv(np.eye(6) + spread @ before.knowledge.information)) / 6.0
    return 1.0 + (alike - 1.0) * float(left)


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


def seen_at(before: Belief | None, frame: Frame) -> float | None:
    """Instant of the last visual pose [s], this frame's included."""
    if frame.T_ho_visual is not None:
        return frame.time
    return None if before is None else before.seen_at
