# SPDX-License-Identifier: MIT
r"""How sure an estimate is, with offsets that stay and are not estimated: a consider covariance (Schmidt-Kalman).

A frame gives information S about the pose, the offsets marginalized out, and a pull B: where the offsets are c, its
estimate is off by S^-1 B c. Over frames the estimate minimises (memory Lambda) + (frame) / n, so

    M = Lambda + S / n                              information with which the pose counts in the next frame
    X = M^-1 (Lambda X' + B / n)                    error of the estimate for each offset: it does not average out
    N = M^-1 (Lambda N' Lambda + (S - B P0 B') / n) M^-1        what does

where P0 is P without the correlations of camera and joints, which a frame's weights leave out, and X' and N' are those
of the frame before, N' widened by the motion since. The covariance of the estimate is

    N + X P X'.

In a first frame, where Lambda = 0 and n = 1, that is S^-1.
"""

from __future__ import annotations

from typing import NamedTuple

import gtsam
import numpy as np

from .covariance import covariance_of, known_inverse
from .graph import FrameFactors
from .offsets import CAMERA, CalibrationPrior


class FrameInformation(NamedTuple):
    """What a frame, its hand or its visual pose says of the object's pose.

    Attributes:
        information: S, shape (6, 6).
        gradient: Of its cost, the joints' zeros at their best, shape (6,); what is remembered holds against it.
        pull: B, shape (6, 6 + J).
        noise: S - B P0 B', the part of S^-1 B that noise has, shape (6, 6).
    """

    information: np.ndarray
    gradient: np.ndarray
    pull: np.ndarray
    noise: np.ndarray

    @property
    def offsets_share(self) -> float:
        """Mean share of the variances S^-1 that the offsets make, in [0, 1]; 0 where nothing is said."""
        if not self.pull.any():
            return 0.0
        inverse = known_inverse(self.information)
        known = np.trace(inverse @ self.information)
        made = np.trace(inverse @ (self.information - self.noise))
        return float(made / known) if known > 0.0 else 0.0

    def doubted(self, kappa: float, prior: CalibrationPrior) -> FrameInformation:
        """As if it said 1 / kappa as much (``doubt``); the offsets pull the pose as far as before."""
        S, B = self.information / kappa, self.pull / kappa
        return FrameInformation(S, self.gradient / kappa, B, S - B @ prior.apart @ B.T)

    def plus(self, other: FrameInformation) -> FrameInformation:
        """Both together; they have no offset in common."""
        return FrameInformation(*(mine + its for mine, its in zip(self, other, strict=True)))


class Knowledge(NamedTuple):
    """What all frames so far know of the pose.

    Attributes:
        information: M, shape (6, 6); zero along what nothing has measured.
        noise: N, shape (6, 6).
        sensitivity: X, shape (6, 6 + J).
    """

    information: np.ndarray
    noise: np.ndarray
    sensitivity: np.ndarray

    def covariance(self, prior: CalibrationPrior) -> np.ndarray:
        """N + X P X', shape (6, 6), infinite along what nothing has measured."""
        covariance: np.ndarray = (
            self.noise + self.sensitivity @ prior.covariance @ self.sensitivity.T
        )
        unmeasured = ~np.isfinite(covariance_of(self.information))
        covariance[unmeasured] = covariance_of(self.information)[unmeasured]
        return covariance


def hand_information(
    factors: FrameFactors, values: gtsam.Values, prior: CalibrationPrior
) -> FrameInformation:
    """What a frame's hand says at the estimate; robust losses count with the weights they leave."""
    pull = np.zeros((6, len(prior.covariance)))
    H, b = factors.normal_equations(factors.hand_graph(), values)
    information, gradient = H[:6, :6], -b[:6]
    if len(H) > 6:  # the joints' zeros, with their prior, are the rest
        gain = np.linalg.solve(H[6:, 6:], H[6:, :6])
        information = information - H[:6, 6:] @ gain
        gradient = gradient + gain.T @ b[6:]
        pull[:, CAMERA:] = gain.T @ np.linalg.inv(prior.covariance[CAMERA:, CAMERA:])
    return FrameInformation(information, gradient, pull, information - pull @ prior.apart @ pull.T)


def vision_information(
    visual: gtsam.PriorFactorPose3,
    values: gtsam.Values,
    prior: CalibrationPrior,
    T_wo_visual: gtsam.Pose3,
) -> FrameInformation:
    """What a frame's visual pose says at the estimate, with the weight that its robust loss leaves."""
    pull = np.zeros((6, len(prior.covariance)))
    jacobian, b = visual.linearize(values).jacobian()
    information = jacobian.T @ jacobian
    if prior.camera_uncertain:
        pull[:, :CAMERA] = information @ prior.camera_jacobian(T_wo_visual)
    noise = information - pull @ prior.apart @ pull.T
    return FrameInformation(information, -jacobian.T @ b, pull, noise)


def fused(
    frame: FrameInformation,
    memory: np.ndarray | None = None,
    before: Knowledge | None = None,
    spread: np.ndarray | None = None,
    repetitions: float = 1.0,
) -> Knowledge:
    """What is known after a frame.

    Args:
        frame: What it says.
        memory: Lambda, the information with which the frames before counted in it, shape (6, 6).
        before: What was known after the frame before.
        spread: How the pose may have moved since, a covariance (6, 6).
        repetitions: n, as one of how many frames that say the same it counts.
    """
    if memory is None or before is None or spread is None:
        inverse = known_inverse(frame.information)
        return Knowledge(frame.information, inverse @ frame.noise @ inverse, inverse @ frame.pull)
    information = memory + frame.information / repetitions
    inverse = known_inverse(information)
    noise = memory @ (before.noise + spread) @ memory + frame.noise / repetitions
    pull = memory @ before.sensitivity + frame.pull / repetitions
    return Knowledge(information, inverse @ noise @ inverse, inverse @ pull)
