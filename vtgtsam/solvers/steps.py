# SPDX-License-Identifier: MIT
r"""The solvers' steps, compiled: those that GTSAM's optimisers take over the frame's factor graph, in one call.

A frame has one unknown, a pose, and a dozen rows. GTSAM spends more on its graph, its elimination and its calls back to
Python than the frame's own arithmetic takes; nothing else is different. ``tests/vtgtsam/solvers`` and ``python -m
benchmarks exactness`` hold the two to the same poses, frame for frame.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..cholesky import factorize
from ..cholesky import solve as solve_factorized
from ..compiled import compiled, copy_matrix
from ..config import EstimatorConfig
from ..objective import Objective, cost, linearize
from ..se3 import retract
from .solution import Solution

# GTSAM's defaults (LevenbergMarquardtParams).
LAMBDA_FACTOR = 10.0
LAMBDA_UPPER_BOUND = 1e5
MIN_MODEL_FIDELITY = 1e-3
EPSILON = float(np.finfo(np.float64).eps)


def solve(objective: Objective, T_wo: np.ndarray, config: EstimatorConfig) -> Solution:
    """Minimise a frame's cost from T_wo (4, 4) on."""
    steps = levenberg_marquardt if config.solver == "lm" else fixed_damping
    return Solution(*steps(T_wo, config.damping, config.iterations, *objective.tables))


@compiled
def levenberg_marquardt(
    T_start: Any, damping: float, iterations: int, of_visual: Any, of_hand: Any, of_search: Any
) -> Any:
    """Steps of ``gtsam.LevenbergMarquardtOptimizer`` (identity damping, no tolerances): pose, moved, iterations, cost.

    A step is taken if it lowers the cost by at least ``MIN_MODEL_FIDELITY`` of what the linear model promises. Then the
    damping falls by ``LAMBDA_FACTOR``, else it rises and the same linear system is solved again, up to
    ``LAMBDA_UPPER_BOUND``. A promise below the rounding of the model's cost is not tried.

    Args:
        T_start: Where to begin, (4, 4).
        damping: First lambda.
        iterations: Most steps to take.
        of_visual: Table of the visual term.
        of_hand: Table of the hand's terms.
        of_search: Table of their search.
    """
    T, trial, step = np.empty((4, 4)), np.empty((4, 4)), np.empty(6)
    information, gradient = np.empty((6, 6)), np.empty(6)
    copy_matrix(T_start, T)
    error, taken = cost(T, of_visual, of_hand, of_search), 0
    while taken < iterations and error > 0.0 and np.isfinite(error):
        model, _ = linearize(T, of_visual, of_hand, of_search, information, gradient)
        better, trial_error = False, np.inf
        while not better:
            if damped_step(information, gradient, damping, step):
                promised = promise(information, damping, step)
                if promised > EPSILON * model:
                    retract(T, step, trial)
                    trial_error = cost(trial, of_visual, of_hand, of_search)
                    better = (error - trial_error) / promised > MIN_MODEL_FIDELITY
            damping = damping / LAMBDA_FACTOR if better else damping * LAMBDA_FACTOR
            if damping >= LAMBDA_UPPER_BOUND:
                break
        if not better:
            break
        copy_matrix(trial, T)
        error, taken = trial_error, taken + 1
    return T, differs(T, T_start), taken, error


@compiled
def fixed_damping(
    T_start: Any, damping: float, iterations: int, of_visual: Any, of_hand: Any, of_search: Any
) -> Any:
    """Exactly ``iterations`` steps of (J'J + damping I) d = -J'r, as Theseus takes them: pose, moved, iterations, cost.

    The steps may raise the cost; one that is not finite ends them. Arguments as for ``levenberg_marquardt``.
    """
    T, trial, step = np.empty((4, 4)), np.empty((4, 4)), np.empty(6)
    information, gradient = np.empty((6, 6)), np.empty(6)
    copy_matrix(T_start, T)
    taken = 0
    while taken < iterations:
        linearize(T, of_visual, of_hand, of_search, information, gradient)
        if not damped_step(information, gradient, damping, step):
            break
        retract(T, step, trial)
        copy_matrix(trial, T)
        taken += 1
    return T, differs(T, T_start), taken, cost(T, of_visual, of_hand, of_search)


@compiled
def differs(A: Any, B: Any) -> bool:
    """Whether two poses (4, 4) differ in any number."""
    for i in range(3):
        for j in range(4):
            if A[i, j] != B[i, j]:
                return True
    return False


@compiled
def damped_step(information: Any, gradient: Any, damping: float, step: Any) -> bool:
    """Solve (information + damping I) step = gradient; whether there is a finite solution."""
    L = np.empty((6, 6))
    return factorize(information, damping, L) and solve_factorized(L, gradient, step)


@compiled
def promise(information: Any, damping: float, step: Any) -> float:
    """How much the linear model's cost falls with the damped step d: 1/2 d'J'Jd + damping d'd."""
    total = 0.0
    for i in range(6):
        total += damping * step[i] * step[i]
        for j in range(6):
            total += 0.5 * step[i] * information[i, j] * step[j]
    return total
