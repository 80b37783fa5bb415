# SPDX-License-Identifier: MIT
"""Whether a solved frame can be believed."""

from __future__ import annotations

import math
from typing import NamedTuple

import gtsam
import numpy as np

from .covariance import LEVER, held_directions
from .estimate import Status
from .graph import FrameGraph, as_graph
from .solver import Solution

REJECTED = 1e-3  # below this visual weight the visual pose pulls less than the damping holds
HELD = 1e-3  # a direction counts as held with this share of the best direction's information
STALL = 1e-3  # [m], a promised step longer than this that the solver could not take is a stall


class Verdict(NamedTuple):
    """A frame's status and the information behind it.

    Attributes:
        status: As in ``Estimate.status``.
        information: Undamped robust information about T_wo, J'WJ, shape (6, 6), rotation first.
    """

    status: Status
    information: np.ndarray


def diagnose(
    factors: FrameGraph, start: gtsam.Pose3, solution: Solution, visual_weight: float
) -> Verdict:
    """Judge a solution.

    Args:
        factors: The frame's factors.
        start: Where the solver started.
        solution: Where it ended.
        visual_weight: What is left of the visual factor's weight there, 0 where the frame has none.
    """
    information, gradient = _linearized(factors.graph, solution.values)
    if visual_weight < REJECTED and not _held(factors.hand, solution.values):
        return Verdict("unobservable" if factors.visual is None else "lost", information)
    if solution.iterations and solution.T_wo.equals(start, 0.0):
        if _newton_step_length(information, gradient) > STALL:
            return Verdict("stalled", information)
    return Verdict("ok", information)


def _held(hand: tuple[gtsam.NonlinearFactor, ...], values: gtsam.Values) -> bool:
    """Whether the hand's factors alone hold the pose in all six directions."""
    information, _ = _linearized(as_graph(hand), values)
    return held_directions(information, HELD) == 6


def _linearized(
    graph: gtsam.NonlinearFactorGraph, values: gtsam.Values
) -> tuple[np.ndarray, np.ndarray]:
    """J'WJ (6, 6) and -J'Wr (6,); zeros where there are no factors."""
    if graph.empty():
        return np.zeros((6, 6)), np.zeros(6)
    information, gradient = graph.linearize(values).hessian()
    return np.ascontiguousarray(information), gradient


def _newton_step_length(information: np.ndarray, gradient: np.ndarray) -> float:
    """Length of the Gauss-Newton step [m], a radian counted as ``LEVER``."""
    step, *_ = np.linalg.lstsq(information, gradient, rcond=1e-6)
    return math.hypot(*(step[:3] * LEVER), *step[3:])
