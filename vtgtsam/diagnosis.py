# SPDX-License-Identifier: MIT
"""Whether a solved frame can be believed."""

from __future__ import annotations

import math

import numpy as np

from .conclusion import Conclusion
from .covariance import LEVER, held_directions
from .estimate import Status
from .solvers.solution import Solution

REJECTED = 1e-3  # below this visual weight the visual pose pulls less than the damping holds
HELD = 1e-3  # a direction counts as held with this share of the best direction's information
STALL = 1e-3  # [m], a promised step longer than this that the solver could not take is a stall


def diagnose(known: Conclusion, start: np.ndarray, solution: Solution, seen: bool) -> Status:
    """Judge a solution.

    Args:
        known: What is known there.
        start: Where the solver started, (4, 4).
        solution: Where it ended.
        seen: Whether the frame has a visual pose.
    """
    if known.visual_weight < REJECTED and held_directions(known.of_hand, HELD) < 6:
        return "lost" if seen else "unobservable"
    if solution.iterations and (solution.T_wo == start).all():
        if _newton_step_length(known.information, known.gradient) > STALL:
            return "stalled"
    return "ok"


def _newton_step_length(information: np.ndarray, gradient: np.ndarray) -> float:
    """Length of the Gauss-Newton step [m], a radian counted as ``LEVER``."""
    step, *_ = np.linalg.lstsq(information, gradient, rcond=1e-6)
    return math.hypot(*(step[:3] * LEVER), *step[3:])
