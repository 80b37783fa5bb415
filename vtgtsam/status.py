# SPDX-License-Identifier: MIT
"""Whether a solved frame can be believed."""

from __future__ import annotations

import math
from typing import NamedTuple

import gtsam
import numpy as np

from .config import EstimatorConfig
from .covariance import LEVER, all_held
from .estimate import Status
from .graph import FrameFactors

REJECTED = 1e-3  # below this visual weight the visual pose pulls less than the damping holds
HELD = 1e-3  # a direction counts as held with this share of the best direction's information
STALL = 1e-3  # [m], a promised step longer than this that the solver could not take is a stall


class Fit(NamedTuple):
    """Where the solver ended.

    Attributes:
        factors: The frame's factors.
        values: The unknowns.
        iterations: Steps taken.
        error: Cost there, 1/2 sum rho.
        moved: Whether that is another pose than the start.
        visual_weight: What is left of the visual pose's weight after its robust loss; 0 where there is none.
    """

    factors: FrameFactors
    values: gtsam.Values
    iterations: int
    error: float
    moved: bool
    visual_weight: float

    @property
    def T_ho(self) -> gtsam.Pose3:
        """The pose, in the hand."""
        return self.values.atPose3(self.factors.key)


def status_of(fit: Fit, information: np.ndarray, config: EstimatorConfig) -> Status:
    """Judge a solution; ``information`` (6, 6) is what is known of the pose there, memory included."""
    seen = fit.factors.visual is not None
    if config.method == "vis":
        return "ok" if seen else "lost"
    if fit.visual_weight < REJECTED and not (
        held_by_hand(fit) or (config.memory and all_held(information, HELD))
    ):
        return "lost" if seen else "unobservable"
    if not fit.moved and newton_step_length(fit) > STALL:
        return "stalled"
    return "ok"


def is_lost(fit: Fit) -> bool:
    """Whether the visual pose is too far away to count, and the pads leave some direction free."""
    return fit.visual_weight < REJECTED and not held_by_hand(fit)


def visual_weight(
    visual: gtsam.PriorFactorPose3 | None,
    values: gtsam.Values,
    log_theta: float,
    images_alike: float = 1.0,
) -> float:
    """How much the visual pose counts after its Welsch loss, in [0, 1]: rho' = 1 - rho / theta.

    As if it counted alone: beside images that err alike its loss in the graph is ``images_alike`` times smaller.
    """
    if visual is None:
        return 0.0
    loss = 2.0 * images_alike * visual.error(values)
    return max(0.0, 1.0 - loss / math.exp(log_theta))


def held_by_hand(fit: Fit) -> bool:
    """Whether the hand's factors alone hold the pose in all six directions."""
    return all_held(fit.factors.information(fit.factors.hand_graph(), fit.values), HELD)


def newton_step_length(fit: Fit) -> float:
    """Length of the Gauss-Newton step [m] of the frame's cost, a radian counted as ``LEVER``."""
    H, b = fit.factors.normal_equations(fit.factors.graph(), fit.values)
    step, *_ = np.linalg.lstsq(H, b, rcond=1e-6)
    return math.hypot(*(step[:3] * LEVER), *step[3:6])
