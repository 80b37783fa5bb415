# SPDX-License-Identifier: MIT
"""Whether a solved frame can be believed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import gtsam
import numpy as np

from .covariance import LEVER, held_directions
from .estimate import Status
from .graph import FrameGraph, as_graph
from .solver import Solution

REJECTED = 1e-3  # below this visual weight the visual pose pulls less than the damping holds
HELD = 1e-3  # a direction counts as held with this share of the best direction's information
STALL = 1e-3  # [m], a promised step longer than this that the solver could not take is a stall


@dataclass(frozen=True, eq=False)
class Verdict:
    """A frame's status and the information behind it.

    Attributes:
        status: As in ``Estimate.status``.
        information: Undamped robust information about T_wo, J'WJ, shape (6, 6), rotation first.
    """

    status: Status
    information: np.ndarray


def diagnose(
    factors: FrameGraph, key: int, start: gtsam.Pose3, solution: Solution, visual_weight: float
) -> Verdict:
    """Judge a solution.

    Args:
        factors: The frame's factors.
        key: Key of the object pose.
        start: Where the solver started.
        solution: Where it ended.
        visual_weight: What is left of the visual factor's weight there, 0 where the frame has none.
    """
    information, gradient = _linearized(factors.factors, key, solution.T_wo)
    if visual_weight < REJECTED and not _held(factors.hand, key, solution.T_wo):
        return Verdict("unobservable" if factors.visual is None else "lost", information)
    if solution.iterations and solution.T_wo.equals(start, 0.0):
        if _newton_step_length(information, gradient) > STALL:
            return Verdict("stalled", information)
    return Verdict("ok", information)


def _held(hand: tuple[gtsam.NonlinearFactor, ...], key: int, T_wo: gtsam.Pose3) -> bool:
    """Whether the hand's factors alone hold the pose in all six directions."""
    information, _ = _linearized(hand, key, T_wo)
    return held_directions(information, HELD) == 6


def _linearized(
    factors: tuple[gtsam.NonlinearFactor, ...], key: int, T_wo: gtsam.Pose3
) -> tuple[np.ndarray, np.ndarray]:
    """J'WJ (6, 6) and -J'Wr (6,) at T_wo; zeros where there are no factors."""
    if not factors:
        return np.zeros((6, 6)), np.zeros(6)
    values = gtsam.Values()
    values.insert(key, T_wo)
    information, gradient = as_graph(factors).linearize(values).hessian()
    return np.ascontiguousarray(information), gradient


def _newton_step_length(information: np.ndarray, gradient: np.ndarray) -> float:
    """Length of the Gauss-Newton step [m], a radian counted as ``LEVER``."""
    step, *_ = np.linalg.lstsq(information, gradient, rcond=1e-6)
    return math.hypot(*(step[:3] * LEVER), *step[3:])
