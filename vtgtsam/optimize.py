# SPDX-License-Identifier: MIT
"""The two ways to minimise a frame's graph: GTSAM's Levenberg-Marquardt, and steps of constant damping."""

from __future__ import annotations

import math
from functools import cache
from typing import NamedTuple

import gtsam
import numpy as np

from .config import EstimatorConfig


class Solution(NamedTuple):
    """Where a solver ended.

    Attributes:
        values: The unknowns.
        iterations: Steps taken.
        error: Cost there, 1/2 sum rho.
    """

    values: gtsam.Values
    iterations: int
    error: float


def optimize(
    graph: gtsam.NonlinearFactorGraph, start: gtsam.Values, config: EstimatorConfig
) -> Solution:
    """Minimise a graph's cost from ``start`` on, with the configured solver."""
    if config.solver == "lm":
        return levenberg_marquardt(
            graph, start, config.damping, config.iterations, config.damping_max
        )
    return fixed_damping(graph, start, config.damping, config.iterations)


def levenberg_marquardt(
    graph: gtsam.NonlinearFactorGraph,
    start: gtsam.Values,
    damping: float,
    iterations: int,
    damping_max: float = 1e5,
) -> Solution:
    """GTSAM's optimiser: it adapts the damping and takes only steps that lower the cost."""
    optimizer = gtsam.LevenbergMarquardtOptimizer(
        graph, start, _parameters(damping, iterations, damping_max)
    )
    values = optimizer.optimize()
    return Solution(values, optimizer.iterations(), optimizer.error())


@cache
def _parameters(
    damping: float, iterations: int, damping_max: float
) -> gtsam.LevenbergMarquardtParams:
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setlambdaInitial(damping)
    parameters.setlambdaUpperBound(damping_max)
    parameters.setMaxIterations(iterations)
    # Costs can be squared metres: the default absolute tolerance of 1e-5 would stop millimetres away. A step that takes
    # a billionth of the cost away is some ten nanometres long, and the next ones would be rounding.
    parameters.setRelativeErrorTol(1e-9)
    parameters.setAbsoluteErrorTol(0.0)
    parameters.setDiagonalDamping(False)
    # There are one or two variables: no tree of cliques to build, which takes a third of a cold frame's solving.
    parameters.setLinearSolverType("SEQUENTIAL_CHOLESKY")
    return parameters


def fixed_damping(
    graph: gtsam.NonlinearFactorGraph, values: gtsam.Values, damping: float, iterations: int
) -> Solution:
    """Exactly ``iterations`` steps of (J'J + damping I) d = -J'r, each taken: what Theseus does.

    The damping enters as one more linear factor a variable, damping |d|^2. The steps may raise the cost; a step that
    is not finite ends them.
    """
    sizes = values.zeroVectors()
    dampers = [_damper(key, sizes.dim(key), damping) for key in values.keys()]
    taken = 0
    while taken < iterations:
        linear = graph.linearize(values)
        for damper in dampers:
            linear.push_back(damper)
        step = linear.optimizeDensely()
        if not math.isfinite(step.norm()):
            break
        values = values.retract(step)
        taken += 1
    return Solution(values, taken, graph.error(values))


@cache
def _damper(key: int, size: int, damping: float) -> gtsam.JacobianFactor:
    precision = gtsam.noiseModel.Isotropic.Precision(size, damping)
    return gtsam.JacobianFactor(key, np.eye(size), np.zeros(size), precision)
