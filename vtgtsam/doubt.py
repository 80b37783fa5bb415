# SPDX-License-Identifier: MIT
r"""How much more unsure a frame's pose is than its linearized factors say.

Where vision is sure to centimetres only, touch holds the pose at one of the places that it allows, and the covariance
there is that of this one place: a box may lie on its next face as well, a ball has rolled along a curve. So now and
then a frame is looked at again as if its visual pose had come out otherwise, by its covariance (randomize, then
optimize: Bardsley, Solonen, Haario and Laine, SIAM J. Sci. Comput. 36(4), 2014). Where all is linear, the poses x_i
that then solve it lie about its own, x, as its information S says, and

    kappa = mean_i ||Log(x^-1 x_i)||^2_S / 6

is about 1. Where kappa is larger, the hand's information counts 1 / kappa. A pose that leaves the cost larger by c
counts e^-c in the mean: it is stuck where nothing is explained.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import gtsam
import numpy as np

EVERY = 0.25  # [s], so often
OVER = 8.0  # poses that the mean is over
WIDE = np.repeat([0.035, 0.002], 3)  # [rad, m], surer vision holds the pose where all is linear
MOST = 100.0  # of one pose, in the mean
FARTHEST = math.pi, 1.0  # [rad], [m], however unsure vision is: farther off nothing touches
# How the visual pose comes out otherwise [sigma], one after the other: what is replayed looks at the same again.
OTHERWISE = np.random.default_rng(0).normal(size=(16, 6))


class Doubt(NamedTuple):
    """The mean so far. A value: the estimator can go back to an earlier one.

    Attributes:
        mean: Over the last poses.
        weight: How many these are, each by its weight.
        looked_at: Instant of the last one [s].
    """

    mean: float = 1.0
    weight: float = 1.0
    looked_at: float = -math.inf

    @property
    def kappa(self) -> float:
        """By how much less the hand's information counts, at least 1."""
        return max(self.mean, 1.0)

    def is_due(self, time: float, covariance: np.ndarray) -> bool:
        """Whether to look again, at a visual pose that is so sure at the object's centre, shape (6, 6)."""
        wide = (np.sqrt(covariance.diagonal()) > WIDE).any()
        return bool(wide and time >= self.looked_at + EVERY)

    def after(self, time: float, squared: float, cost: float) -> Doubt:
        """With one more pose.

        Args:
            time: The instant [s].
            squared: How far it lies off, ||Log(x^-1 x_i)||^2_S / 6.
            cost: How much larger the cost is there.
        """
        counts, kept = math.exp(-max(cost, 0.0)), self.weight * (1.0 - 1.0 / OVER)
        mean = (kept * self.mean + counts * min(squared, MOST)) / (kept + counts)
        return Doubt(mean, kept + counts, time)


def otherwise(T_ho_visual: gtsam.Pose3, covariance: np.ndarray, time: float) -> gtsam.Pose3:
    """The visual pose as it might have come out instead; ``covariance`` (6, 6) of a perturbation of its frame."""
    sigmas = OTHERWISE[round(time / EVERY) % len(OTHERWISE)]
    step = np.linalg.cholesky(covariance) @ sigmas
    beyond = max(np.linalg.norm(step[:3]) / FARTHEST[0], np.linalg.norm(step[3:]) / FARTHEST[1])
    moved: gtsam.Pose3 = T_ho_visual.retract(step / max(beyond, 1.0))
    return moved
