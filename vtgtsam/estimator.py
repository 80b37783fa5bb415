# SPDX-License-Identifier: MIT
r"""The estimator: one factor graph a frame, solved from the previous frame's estimate (paper, section III).

    T_wo* = argmin  1/2 rho_vis(w_vis ||log(T_wo^-1 T_wo_visual)||^2)
                  + 1/2 sum_k rho_tac(w_tac max(0, phi(T_wo^-1 p_k))^2)      pads in contact
                  + 1/2 sum_k         w_pen min(0, phi(T_wo^-1 p_k))^2       all pads

with p_k pad k's grid point of least signed distance phi to the object.
"""

from __future__ import annotations

import logging
import math
from dataclasses import dataclass

import gtsam
import numpy as np
from gtsam.symbol_shorthand import X

from .config import EstimatorConfig, VisualWeight
from .covariance import covariance_of
from .diagnosis import diagnose
from .estimate import Estimate
from .factors.noise import isotropic, pose_noise, welsch_of_each, welsch_of_norm, welsch_weight
from .factors.penetration import penetration_factor
from .factors.tactile import tactile_factor, tactile_residual
from .factors.visual import visual_factor, visual_residual
from .frame import Frame, check
from .measurement import Measurement
from .objects import ObjectModel
from .pads import PadSet
from .sdf.closest import ClosestPoints
from .solver import Solution, solve

logger = logging.getLogger(__name__)

OBJECT = X(0)  # key of the object pose T_wo


@dataclass(frozen=True, eq=False)
class FrameGraph:
    """One frame's factors: all of them, and the hand's alone (without the visual one)."""

    graph: gtsam.NonlinearFactorGraph
    hand: gtsam.NonlinearFactorGraph


class PoseEstimator:
    """Where the object is, frame by frame.

    Poses, contacts and joints in memory: no files, no simulator. Use one thread at a time per estimator; the
    interpreter lock is held while it solves.

    Args:
        hand: The hand with its pads; a plain ``PadSet`` needs ``Measurement.T_wp`` in every frame.
        obj: The object with its distance field.
        config: Settings; ``EstimatorConfig.tuned()`` where not given.
    """

    def __init__(
        self, hand: PadSet, obj: ObjectModel, config: EstimatorConfig | None = None
    ) -> None:
        self.hand = hand
        self.obj = obj
        self.config = EstimatorConfig.tuned() if config is None else config
        self._closest = ClosestPoints(hand, obj.sdf)
        self._T_wo: gtsam.Pose3 | None = None

    def reset(self, T_wo: gtsam.Pose3 | None = None) -> None:
        """Forget; the next frame starts at T_wo, or at its visual pose where T_wo is None."""
        self._T_wo = T_wo

    def update(self, measurement: Measurement) -> Estimate:
        """Fuse one frame.

        Returns:
            The estimate. Trouble with the data is an answer, in ``Estimate.status``.

        Raises:
            ValueError: The measurement has the wrong shape or names, or lacks something: a mistake of the
                program that made it.
        """
        frame = check(measurement, self.hand)
        if frame.invalid:
            logger.warning("t = %s: %s not finite, frame not used", measurement.time, frame.invalid)
            return self._without_solving(measurement.time, "invalid")
        start = frame.T_wo_visual if self._T_wo is None else self._T_wo
        if start is None:
            return self._without_solving(measurement.time, "waiting")
        self._closest.place(frame.T_wp, frame.touching)
        if self.config.method == "vis":
            estimate = self._as_seen(measurement.time, frame, start)
        else:
            estimate = self._fused(measurement.time, frame, start)
            if estimate.status == "lost" and self.config.recover and frame.T_wo_visual is not None:
                logger.info("t = %s: lost, starting again from vision", measurement.time)
                estimate = self._fused(measurement.time, frame, frame.T_wo_visual)
        self._T_wo = estimate.T_wo
        return estimate

    def build_graph(self, frame: Frame) -> FrameGraph:
        """The frame's factors over the one pose ``OBJECT``; the pads must have been placed."""
        graph, hand = gtsam.NonlinearFactorGraph(), gtsam.NonlinearFactorGraph()
        config = self.config
        if frame.T_wo_visual is not None:
            noise = welsch_of_norm(pose_noise(*self._visual_weights(frame)), config.log_theta_vis)
            graph.push_back(visual_factor(OBJECT, frame.T_wo_visual, noise))
        if config.method == "vis+tac+pen" and len(frame.touching):
            noise = welsch_of_each(
                isotropic(len(frame.touching), config.w_tac), config.log_theta_tac
            )
            hand.push_back(tactile_factor(OBJECT, frame.touching, self._closest, noise))
        if config.method != "vis":
            noise = isotropic(len(self.hand), config.w_pen)
            hand.push_back(penetration_factor(OBJECT, self._closest, noise))
        graph.push_back(hand)
        return FrameGraph(graph, hand)

    def _fused(self, time: float, frame: Frame, start: gtsam.Pose3) -> Estimate:
        factors = self.build_graph(frame)
        solution = solve(factors.graph, OBJECT, start, self.config)
        return self._estimate(time, frame, factors, solution, start)

    def _as_seen(self, time: float, frame: Frame, start: gtsam.Pose3) -> Estimate:
        """Method ``vis``: the visual pose as it is, the last one where there is none this frame."""
        T_wo = start if frame.T_wo_visual is None else frame.T_wo_visual
        return self._estimate(time, frame, self.build_graph(frame), Solution(T_wo, 0, 0.0), T_wo)

    def _estimate(
        self,
        time: float,
        frame: Frame,
        factors: FrameGraph,
        solution: Solution,
        start: gtsam.Pose3,
    ) -> Estimate:
        T_wo = solution.T_wo
        visual_weight = self._visual_weight(frame, T_wo)
        verdict = diagnose(factors.graph, factors.hand, OBJECT, solution, start, visual_weight)
        contacts = self._closest.everywhere(T_wo)
        return Estimate(
            time=time,
            T_wo=T_wo,
            covariance=covariance_of(verdict.information),
            status=verdict.status,
            iterations=solution.iterations,
            error=solution.error,
            visual_weight=0.0 if visual_weight is None else visual_weight,
            pad_distances=contacts.distances,
            pad_weights=self._pad_weights(frame, T_wo),
            contact_points_w=self._closest.points_w(contacts),
        )

    def _visual_weights(self, frame: Frame) -> VisualWeight:
        if frame.visual_sigma is None:
            return self.config.visual_weights
        return VisualWeight(*(1.0 / sigma**2 for sigma in frame.visual_sigma))

    def _visual_weight(self, frame: Frame, T_wo: gtsam.Pose3) -> float | None:
        if frame.T_wo_visual is None:
            return None
        residual = visual_residual(T_wo, frame.T_wo_visual)
        weighted = np.repeat(self._visual_weights(frame), 3) * residual**2
        return float(welsch_weight(weighted.sum(), self.config.log_theta_vis))

    def _pad_weights(self, frame: Frame, T_wo: gtsam.Pose3) -> np.ndarray:
        weights = np.zeros(len(self.hand))
        if self.config.method == "vis+tac+pen":
            gaps, _ = tactile_residual(self._closest.at(T_wo), frame.touching)
            weights[frame.touching] = welsch_weight(
                self.config.w_tac * gaps**2, self.config.log_theta_tac
            )
        return weights

    def _without_solving(self, time: float, status: str) -> Estimate:
        """The last pose, with nothing known about it this frame."""
        count = len(self.hand)
        return Estimate(
            time=time,
            T_wo=self._T_wo,
            covariance=covariance_of(np.zeros((6, 6))),
            status=status,  # type: ignore[arg-type]
            iterations=0,
            error=math.nan,
            visual_weight=0.0,
            pad_distances=np.full(count, np.nan),
            pad_weights=np.zeros(count),
            contact_points_w=np.full((count, 3), np.nan),
        )
