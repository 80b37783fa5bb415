# SPDX-License-Identifier: MIT
"""Whether a solved frame can be believed."""

from __future__ import annotations

import math

import numpy as np

from .conclusion import REJECTED, Conclusion
from .covariance import LEVER
from .estimate import Status
from .objective import Objective, linearize
from .solvers.solution import Solution

STALL = 1e-3  # [m], a promised step longer than this that the solver could not take is a stall


def diagnose(objective: Objective, solution: Solution, known: Conclusion, seen: bool) -> Status:
    """Judge a solution.

    Args:
        objective: The frame's terms.
        solution: Where the solver ended.
        known: What is known there.
        seen: Whether the frame has a visual pose.
    """
    if known.visual_weight < REJECTED and not known.held:
        return "lost" if seen else "unobservable"
    if solution.iterations and not solution.moved:
        if _newton_step_length(objective, solution.T_wo) > STALL:
            return "stalled"
    return "ok"


def _newton_step_length(objective: Objective, T_wo: np.ndarray) -> float:
    """Length of the Gauss-Newton step [m], a radian counted as ``LEVER``."""
    information, gradient = np.empty((6, 6)), np.empty(6)
    linearize(T_wo, *objective.tables, information, gradient)
    step, *_ = np.linalg.lstsq(information, gradient, rcond=1e-6)
    return math.hypot(*(step[:3] * LEVER), *step[3:])
