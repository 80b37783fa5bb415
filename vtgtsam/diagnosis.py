# SPDX-License-Identifier: MIT
"""Whether a solved frame can be believed."""

from __future__ import annotations

import math
from dataclasses import dataclass

import gtsam
import numpy as np

from .covariance import LEVER, held_directions
from .estimate import Status
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
    graph: gtsam.NonlinearFactorGraph,
    hand: gtsam.NonlinearFactorGraph,
    key: int,
    solution: Solution,
    start: gtsam.Pose3,
    visual_weight: float | None,
) -> Verdict:
    """Judge a solution.

    Args:
        graph: All the frame's factors.
        hand: The tactile and penetration factors alone.
        key: Key of the object pose.
        solution: Where the solver ended.
        start: Where it started.
        visual_weight: What is left of the visual factor's weight, or None where the frame has none.
    """
    information, gradient = _linearized(graph, key, solution.T_wo)
    status: Status = "ok"
    if visual_weight is None or visual_weight < REJECTED:
        hand_information, _ = _linearized(hand, key, solution.T_wo)
        if held_directions(hand_information, HELD) < 6:
            status = "unobservable" if visual_weight is None else "lost"
    if status == "ok" and solution.T_wo.equals(start, 0.0) and solution.iterations:
        promised = _newton_step_length(information, gradient)
        status = "stalled" if promised > STALL else "ok"
    return Verdict(status, information)


def _linearized(
    graph: gtsam.NonlinearFactorGraph, key: int, T_wo: gtsam.Pose3
) -> tuple[np.ndarray, np.ndarray]:
    """J'WJ (6, 6) and -J'Wr (6,) at T_wo; zeros where there are no factors."""
    if graph.size() == 0:
        return np.zeros((6, 6)), np.zeros(6)
    values = gtsam.Values()
    values.insert(key, T_wo)
    return graph.linearize(values).hessian()


def _newton_step_length(information: np.ndarray, gradient: np.ndarray) -> float:
    """Length of the Gauss-Newton step [m], a radian counted as ``LEVER``."""
    step, *_ = np.linalg.lstsq(information, gradient, rcond=1e-6)
    return math.hypot(*(step[:3] * LEVER), *step[3:])
