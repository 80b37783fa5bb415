# SPDX-License-Identifier: MIT
r"""Solve for the offsets, and what each grasp says of them.

Poses and contact offsets belong to one grasp each: solved out of its linearized factors, they leave information about
the shared offsets c = (e, dq) alone,

    1/2 (c - c0)' H_g (c - c0) - eta_g' (c - c0),

and grasps add up: the posterior has the information P0^-1 + sum_g H_g.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import gtsam
import numpy as np

from ..config import EstimatorConfig
from ..factors.known_offsets import known_offsets_factor
from .graph import CAMERA, ZEROS, add_grasp
from .keyframes import Grasp
from .touches import Felt, add_touches

ITERATIONS = 20  # at most
# Poses and closest points go on settling for long after the offsets have: these decide.
SETTLED = 0.06  # of the standard deviations believed before; a shorter step is none
STILL = 2  # such steps in a row end the solving
DONE = 1e-4  # relative decrease of the cost that is none


class Belief(NamedTuple):
    """What is believed of the offsets.

    Attributes:
        mean: The camera's six, then the joints' zeros, shape (6 + J,).
        covariance: Shape (6 + J, 6 + J).
    """

    mean: np.ndarray
    covariance: np.ndarray


class Said(NamedTuple):
    """What one grasp says of the offsets, linearized at the solution.

    Attributes:
        information: H, shape (6 + J, 6 + J).
        pull: eta, shape (6 + J,): where the grasp alone would rather have them, times H.
        error: The cost of its factors there.
    """

    information: np.ndarray
    pull: np.ndarray
    error: float


class Solved(NamedTuple):
    """The offsets after all grasps.

    Attributes:
        belief: Their posterior.
        said: What each grasp said.
        values: All unknowns.
        iterations: Steps taken.
    """

    belief: Belief
    said: list[Said]
    values: gtsam.Values
    iterations: int


def solve(
    grasps: Sequence[Grasp],
    prior: Belief,
    start: np.ndarray,
    camera_origin: np.ndarray,
    config: EstimatorConfig,
    touches: Sequence[Felt] = (),
    settled: float = SETTLED,
) -> Solved:
    """Minimise the cost of all grasps and the prior.

    Args:
        grasps: What was recorded.
        prior: What was known of the offsets before.
        start: Where to start with them, shape (6 + J,), or several of those: the lowest cost is the solution.
        camera_origin: The point that the camera's twist turns about, in the world [m], shape (3,).
        config: As the estimator's that tracked the grasps.
        touches: Touches of the hand with itself.
        settled: A step of the offsets shorter than so much of the standard deviations believed before is none.
    """
    graphs = []
    values = gtsam.Values()
    whole = gtsam.NonlinearFactorGraph()
    whole.push_back(known_offsets_factor(CAMERA, ZEROS, prior.mean, prior.covariance))
    for number, grasp in enumerate(grasps):
        graph = gtsam.NonlinearFactorGraph()
        add_grasp(graph, values, number, grasp, camera_origin, config)
        whole.push_back(graph)
        graphs.append(graph)
    alone = gtsam.NonlinearFactorGraph()
    add_touches(alone, grasps[0].hand, touches)
    whole.push_back(alone)
    sigmas = np.sqrt(np.diag(prior.covariance))
    starts = [_with_offsets(values, each) for each in np.atleast_2d(start)]
    minima = [_minimised(whole, each, sigmas, settled) for each in starts]
    values, iterations = min(minima, key=lambda minimum: whole.error(minimum[0]))
    said = [_said(graph, values) for graph in graphs]
    information = np.linalg.inv(prior.covariance) + sum(each.information for each in said)
    if touches:
        information[6:, 6:] += alone.linearize(values).hessian()[0]
    belief = Belief(_offsets(values), np.linalg.inv(information))
    return Solved(belief, said, values, iterations)


def _minimised(
    graph: gtsam.NonlinearFactorGraph,
    values: gtsam.Values,
    sigmas: np.ndarray,
    settled: float,
) -> tuple[gtsam.Values, int]:
    """GTSAM's Levenberg-Marquardt, whose steps lower the cost, until the offsets stay where they are."""
    optimizer = gtsam.LevenbergMarquardtOptimizer(graph, values, _parameters())
    offsets, cost, still = _offsets(values), optimizer.error(), 0
    while still < STILL and optimizer.iterations() < ITERATIONS:
        optimizer.iterate()
        now, lower = _offsets(optimizer.values()), optimizer.error()
        still = still + 1 if np.linalg.norm((now - offsets) / sigmas) < settled else 0
        if cost - lower <= DONE * cost:
            break
        offsets, cost = now, lower
    return optimizer.values(), optimizer.iterations()


def _with_offsets(values: gtsam.Values, offsets: np.ndarray) -> gtsam.Values:
    """The values of the grasps' own unknowns, and offsets beside them."""
    started = gtsam.Values(values)
    started.insert(CAMERA, offsets[:6])
    started.insert(ZEROS, offsets[6:])
    return started


def _offsets(values: gtsam.Values) -> np.ndarray:
    """The camera's six, then the joints' zeros, shape (6 + J,)."""
    offsets: np.ndarray = np.concatenate([values.atVector(CAMERA), values.atVector(ZEROS)])
    return offsets


def _said(graph: gtsam.NonlinearFactorGraph, values: gtsam.Values) -> Said:
    """Solve a grasp's own unknowns out of its factors."""
    linear = graph.linearize(values)
    ordering = gtsam.Ordering()
    for key in (CAMERA, ZEROS):
        ordering.push_back(key)
    H, eta = linear.marginal([CAMERA, ZEROS]).hessian(ordering)
    return Said(H, eta, graph.error(values))


def _parameters() -> gtsam.LevenbergMarquardtParams:
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setlambdaInitial(1e-4)
    parameters.setDiagonalDamping(True)
    return parameters
