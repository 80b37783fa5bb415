# SPDX-License-Identifier: MIT
"""The two ways a frame's graph is solved: GTSAM's Levenberg-Marquardt, and steps of constant damping."""

from __future__ import annotations

from dataclasses import dataclass

import gtsam
import numpy as np

from .config import EstimatorConfig


@dataclass(frozen=True, eq=False)
class Solution:
    """Where the solver ended.

    Attributes:
        T_wo: The pose.
        iterations: Steps taken.
        error: Cost there, 1/2 sum rho.
    """

    T_wo: gtsam.Pose3
    iterations: int
    error: float


def solve(
    graph: gtsam.NonlinearFactorGraph, key: int, T_wo: gtsam.Pose3, config: EstimatorConfig
) -> Solution:
    """Minimise the graph's cost over the one pose ``key``, starting at T_wo."""
    values = gtsam.Values()
    values.insert(key, T_wo)
    if config.solver == "lm":
        return levenberg_marquardt(graph, key, values, config)
    return fixed_damping(graph, key, values, config)


def levenberg_marquardt(
    graph: gtsam.NonlinearFactorGraph, key: int, values: gtsam.Values, config: EstimatorConfig
) -> Solution:
    """GTSAM's optimiser: it adapts the damping and takes only steps that lower the cost."""
    optimizer = gtsam.LevenbergMarquardtOptimizer(graph, values, _parameters(config))
    result = optimizer.optimize()
    return Solution(result.atPose3(key), optimizer.iterations(), optimizer.error())


def _parameters(config: EstimatorConfig) -> gtsam.LevenbergMarquardtParams:
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setlambdaInitial(config.damping)
    parameters.setMaxIterations(config.iterations)
    # Costs here are squared metres: the default tolerances of 1e-5 would stop millimetres away.
    parameters.setRelativeErrorTol(0.0)
    parameters.setAbsoluteErrorTol(0.0)
    parameters.setDiagonalDamping(False)
    return parameters


def fixed_damping(
    graph: gtsam.NonlinearFactorGraph, key: int, values: gtsam.Values, config: EstimatorConfig
) -> Solution:
    """Exactly ``iterations`` steps of (J'J + damping I) d = -J'r, each taken: what Theseus does.

    The steps may raise the cost; a step that is not finite ends them.
    """
    taken = 0
    while taken < config.iterations:
        step = damped_step(*graph.linearize(values).hessian(), config.damping)
        if not np.isfinite(step).all():
            break
        values = _retract(values, key, step)
        taken += 1
    return Solution(values.atPose3(key), taken, graph.error(values))


def damped_step(information: np.ndarray, gradient: np.ndarray, damping: float) -> np.ndarray:
    """Solution d of (J'J + damping I) d = -J'r, shape (6,), given J'J (6, 6) and -J'r (6,)."""
    return np.linalg.solve(information + damping * np.eye(len(information)), gradient)


def _retract(values: gtsam.Values, key: int, step: np.ndarray) -> gtsam.Values:
    delta = gtsam.VectorValues()
    delta.insert(key, step)
    return values.retract(delta)
