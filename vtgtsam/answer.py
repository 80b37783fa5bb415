# SPDX-License-Identifier: MIT
"""What an estimator answers: the estimate of a solved frame, and of one that could not be solved."""

from __future__ import annotations

import math

import gtsam
import numpy as np

from .config import EstimatorConfig
from .covariance import covariance_of
from .estimate import Estimate, Status
from .factors.noise import welsch_weight
from .frame import Frame
from .modes import Mode
from .offsets import CalibrationPrior
from .solver import Solved
from .status import Fit, status_of


def solved_estimate(
    frame: Frame, mode: Mode, solved: Solved, prior: CalibrationPrior, config: EstimatorConfig
) -> Estimate:
    """What is known where the solver ended."""
    fit, knowledge = solved.fit, solved.knowledge
    distances, points_w = _pads_at(frame, fit)
    return Estimate(
        time=frame.time,
        T_wo=frame.T_wh.compose(fit.T_ho),
        covariance=knowledge.covariance(prior),
        status=status_of(fit, knowledge.information, config),
        faults=frame.faults,
        mode=mode if config.memory else None,
        events=(),
        iterations=fit.iterations,
        error=fit.error,
        visual_weight=fit.visual_weight,
        pad_distances=distances,
        pad_weights=_pad_weights(distances, frame.touching, config),
        contact_points_w=points_w,
    )


def unsolved_estimate(frame: Frame, status: Status, T_wo: gtsam.Pose3 | None) -> Estimate:
    """The last pose, with nothing known about it this frame."""
    count = len(frame.touching)
    return Estimate(
        time=frame.time,
        T_wo=T_wo,
        covariance=covariance_of(np.zeros((6, 6))),
        status=status,
        faults=frame.faults,
        mode=None,
        events=(),
        iterations=0,
        error=math.nan,
        visual_weight=0.0,
        pad_distances=np.full(count, np.nan),
        pad_weights=np.zeros(count),
        contact_points_w=np.full((count, 3), np.nan),
    )


def _pads_at(frame: Frame, fit: Fit) -> tuple[np.ndarray, np.ndarray]:
    """Distances of all pads [m], (K,), and closest points in the world, (K, 3); NaN where pads are not known."""
    if not frame.pads_known:
        count = len(frame.touching)
        return np.full(count, np.nan), np.full((count, 3), np.nan)
    contacts = fit.factors.pads.everywhere(fit.T_ho)
    points_h = fit.factors.pads.points_h(contacts)
    return contacts.distances, frame.T_wh.transformFrom(points_h.T).T


def _pad_weights(
    distances: np.ndarray, touching: np.ndarray, config: EstimatorConfig
) -> np.ndarray:
    if "tac" not in config.method:
        return np.zeros(len(distances))
    squared = config.w_tac * np.square(np.maximum(distances, 0.0))
    weights = touching * welsch_weight(squared, config.log_theta_tac)
    return np.nan_to_num(weights)  # type: ignore[no-any-return]
