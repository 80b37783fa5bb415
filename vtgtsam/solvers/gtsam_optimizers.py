# SPDX-License-Identifier: MIT
"""The two ways GTSAM solves a frame's graph: its Levenberg-Marquardt, and steps of constant damping."""

from __future__ import annotations

import math
from functools import cache

import gtsam
import numpy as np

from ..config import EstimatorConfig
from .solution import Solution


def solve(
    graph: gtsam.NonlinearFactorGraph, key: int, T_wo: np.ndarray, config: EstimatorConfig
) -> Solution:
    """Minimise the graph's cost over the one pose ``key``, starting at T_wo (4, 4)."""
    start = gtsam.Values()
    start.insert(key, gtsam.Pose3(T_wo))
    steps = levenberg_marquardt if config.solver == "lm" else fixed_damping
    values, iterations, error = steps(graph, key, start, config)
    found = np.ascontiguousarray(values.atPose3(key).matrix())
    return Solution(found, not np.array_equal(found, T_wo), iterations, error)


def levenberg_marquardt(
    graph: gtsam.NonlinearFactorGraph, key: int, values: gtsam.Values, config: EstimatorConfig
) -> tuple[gtsam.Values, int, float]:
    """GTSAM's optimiser: it adapts the damping and takes only steps that lower the cost."""
    parameters = _parameters(config.damping, config.iterations)
    optimizer = gtsam.LevenbergMarquardtOptimizer(graph, values, parameters)
    values = optimizer.optimize()
    return values, optimizer.iterations(), optimizer.error()


@cache
def _parameters(damping: float, iterations: int) -> gtsam.LevenbergMarquardtParams:
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setlambdaInitial(damping)
    parameters.setMaxIterations(iterations)
    # Costs here are squared metres: the default tolerances of 1e-5 would stop millimetres away.
    parameters.setRelativeErrorTol(0.0)
    parameters.setAbsoluteErrorTol(0.0)
    parameters.setDiagonalDamping(False)
    # There is one variable: no tree of cliques to build, which takes a third of a cold frame's solving.
    parameters.setLinearSolverType("SEQUENTIAL_CHOLESKY")
    return parameters


def fixed_damping(
    graph: gtsam.NonlinearFactorGraph, key: int, values: gtsam.Values, config: EstimatorConfig
) -> tuple[gtsam.Values, int, float]:
    """Exactly ``iterations`` steps of (J'J + damping I) d = -J'r, each taken: what Theseus does.

    The damping enters as one more linear factor, damping |d|^2. The steps may raise the cost; a step that is
    not finite ends them.
    """
    damper = _damper(key, config.damping)
    taken = 0
    while taken < config.iterations:
        linear = graph.linearize(values)
        linear.push_back(damper)
        step = linear.optimizeDensely()
        if not math.isfinite(step.norm()):
            break
        values = values.retract(step)
        taken += 1
    return values, taken, graph.error(values)


@cache
def _damper(key: int, damping: float) -> gtsam.JacobianFactor:
    precision = gtsam.noiseModel.Isotropic.Precision(6, damping)
    return gtsam.JacobianFactor(key, np.eye(6), np.zeros(6), precision)
