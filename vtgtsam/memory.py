# SPDX-License-Identifier: MIT
r"""What an estimator remembers: the last posterior, and since when vision has been refused.

Before a frame the last posterior is widened by the motion of the present mode and enters as one more factor,

    n/2 ||Log(T_ho(t-1)^-1 T_ho)||^2_Lambda,    Lambda = (M(t-1)^-1 + Q_mode(dt))^-1,

n times as heavy since the frame's own terms count as one of n that say the same (``modes``). Where two images show how
the object moved, it is expected there, and Q is what that leaves unsure (``seen_motion``).

A visual pose whose errors stay alike for tau seconds (``Measurement.visual_correlation``) repeats what memory holds of
the images before, dt seconds ago and earlier. So it counts as one of

    m = max(n, 1 + (tau / dt - 1) s),    s = tr((I + Q_mode M(t-1))^-1) / 6

images, tau / dt of them as far as memory still holds what they said: s is the mean share of what was known that is left
after the motion, 1 of an object that does not move, 0 of one that moves far. Its loss is divided by m / n beside touch.
(Of errors with autocorrelation exp(-t / tau'), N images in a long time T are worth T / (2 tau') independent ones;
Bayley and Hammersley, "The Effective Number of Independent Observations in an Autocorrelated Time Series", 1946. So
tau = 2 tau', the integral of the autocorrelation.)

What a robot believes wrongly of itself stays as well, and with it the pads' errors, by the share r of them that it
makes (``FrameInformation.offsets_share``). Beside images that err alike a frame's pads are not to count as often as if
each frame were news, so with tau_r = ``offsets_correlation`` the frame counts as one of

    n' = max(n, min(m, 1 + (tau_r / dt - 1) s r)),

but of no more than images do: a tracker that has settled beside the object must not win for being seen often.
"""

from __future__ import annotations

from typing import NamedTuple

import gtsam
import numpy as np

from .config import EstimatorConfig, ModeSettings
from .doubt import Doubt
from .factors.motion import motion_factor, widened
from .frame import Frame
from .knowledge import FrameInformation, Knowledge, fused
from .modes import Mode, random_walk, repetitions
from .seen_motion import Seen, seen_motion

TOGETHER = 0.15  # [s], visual poses that are farther apart may err otherwise: the tracker has lost and found it


class Belief(NamedTuple):
    """What is believed after a frame. A value: the estimator can go back to an earlier one.

    Attributes:
        time: The frame's instant [s].
        T_ho: Pose of the object in the hand.
        knowledge: How sure that is; None where nothing is remembered but the pose.
        refused_since: Instant [s] from which on vision has been refused; None where it is believed.
        seen_at: Instant of the last visual pose [s]; None where there has been none.
        offsets_share: By which share what the hand said is as uncertain as it is because of the robot's offsets.
        seen: The last visual pose, if it was believed.
        doubt: How much less the hand's information counts.
    """

    time: float
    T_ho: gtsam.Pose3
    knowledge: Knowledge | None = None
    refused_since: float | None = None
    seen_at: float | None = None
    offsets_share: float = 0.0
    seen: Seen | None = None
    doubt: Doubt = Doubt()


class Expectation(NamedTuple):
    """What the frames before say about the pose now.

    Attributes:
        T_ho: The last pose, moved as images show.
        before: How sure it was.
        spread: How the pose may have moved otherwise since, a covariance (6, 6).
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
    T_ho, spread = before.T_ho, random_walk(settings, dt)
    if dt > 0.0 and mode != "held" and _shows_motion(before, frame):
        assert before.seen is not None and before.seen_at is not None
        walk = random_walk(settings, frame.time - before.seen_at)
        motion, left = seen_motion(before.seen, T_ho, frame, walk, config)
        T_ho, spread = T_ho.retract(motion), left @ spread
        spread = (spread + spread.T) / 2.0
    information = before.knowledge.information
    if dt > 0.0:
        information = widened(information, spread)
    n, m = repetitions(settings.correlation, dt), images_alike(before, frame, spread)
    if m > n:
        n = max(n, min(m, pads_alike(before, dt, spread, config)))
    return Expectation(T_ho, before.knowledge, spread, information, n, max(1.0, m / n))


def _shows_motion(before: Belief, frame: Frame) -> bool:
    """Whether a frame's visual pose and the last one tell of the motion between them."""
    if before.seen is None or before.seen_at is None or frame.T_ho_visual is None:
        return False
    return not frame.suspect and frame.time - before.seen_at <= TOGETHER


def images_alike(before: Belief, frame: Frame, spread: np.ndarray) -> float:
    """m: as one of how many images that err alike a frame's visual pose counts; see above."""
    if frame.visual_correlation == 0.0 or before.seen_at is None:
        return 1.0
    alike = repetitions(frame.visual_correlation, frame.time - before.seen_at)
    return 1.0 + (alike - 1.0) * _left(before, spread)


def pads_alike(before: Belief, dt: float, spread: np.ndarray, config: EstimatorConfig) -> float:
    """As one of how many frames whose pads err alike a frame counts dt [s] after the one before; see above."""
    alike = repetitions(config.offsets_correlation, dt)
    return 1.0 + (alike - 1.0) * _left(before, spread) * before.offsets_share


def _left(before: Belief, spread: np.ndarray) -> float:
    """s: the mean share of what was known before that the motion since has left."""
    assert before.knowledge is not None
    inverse = np.linalg.inv(np.eye(6) + spread @ before.knowledge.information)
    return float(np.trace(inverse)) / 6.0


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


def with_vision(
    belief: Belief,
    before: Belief | None,
    frame: Frame,
    visual_weight: float,
    config: EstimatorConfig,
) -> Belief:
    """The belief with what the frame's visual pose, or the last one before it, has come to.

    Args:
        belief: What is believed of the pose after the frame.
        before: What was believed before it.
        frame: The frame.
        visual_weight: How much its visual pose counts.
        config: Settings.
    """
    refused = refused_since(before, frame, visual_weight, config)
    if frame.T_ho_visual is not None:
        seen = Seen(frame.T_ho_visual, belief.T_ho) if refused is None else None
        return belief._replace(refused_since=refused, seen_at=frame.time, seen=seen)
    if before is None:
        return belief._replace(refused_since=refused)
    return belief._replace(refused_since=refused, seen_at=before.seen_at, seen=before.seen)
