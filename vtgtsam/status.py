# SPDX-License-Identifier: MIT
"""Whether a solved frame can be believed."""

from __future__ import annotations

import math

import gtsam
import numpy as np

from .covariance import LEVER, all_held
from .estimate import Status
from .graph import FrameFactors

REJECTED = 1e-3  # below this visual weight the visual pose pulls less than the damping holds
HELD = 1e-3  # a direction counts as held with this share of the best direction's information
STALL = 1e-3  # [m], a promised step longer than this that the solver could not take is a stall


def status_of(
    factors: FrameFactors,
    values: gtsam.Values,
    visual_weight: float,
    normal_equations: tuple[np.ndarray, np.ndarray],
    stuck: bool,
) -> Status:
    """Judge a solution.

    Args:
        factors: The frame's factors.
        values: Where the solver ended.
        visual_weight: What is left of the visual pose's weight after its robust loss.
        normal_equations: Information (6, 6) and gradient (6,) there.
        stuck: Whether the solver tried and did not move.
    """
    if visual_weight < REJECTED and not held_by_hand(factors, values):
        touch_may_hold = factors.penetration is not None  # not so with method ``vis``
        return "unobservable" if factors.visual is None and touch_may_hold else "lost"
    if stuck and newton_step_length(*normal_equations) > STALL:
        return "stalled"
    return "ok"


def held_by_hand(factors: FrameFactors, values: gtsam.Values) -> bool:
    """Whether the hand's factors alone hold the pose in all six directions."""
    graph = factors.hand_graph()
    if graph.empty():
        return False
    information, _ = graph.linearize(values).hessian()
    return all_held(information, HELD)


def newton_step_length(information: np.ndarray, gradient: np.ndarray) -> float:
    """Length of the Gauss-Newton step [m], a radian counted as ``LEVER``."""
    step, *_ = np.linalg.lstsq(information, gradient, rcond=1e-6)
    return math.hypot(*(step[:3] * LEVER), *step[3:])
