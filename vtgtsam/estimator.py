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

import gtsam
import numpy as np

from .config import EstimatorConfig
from .covariance import covariance_of
from .diagnosis import diagnose
from .estimate import Estimate, Status
from .factors.noise import welsch_weight_of_loss
from .factors.tactile import tactile_weights
from .frame import Frame, check, require_pose
from .graph import OBJECT, FrameGraph, GraphBuilder
from .measurement import Measurement
from .objects import ObjectModel
from .pads import PadSet
from .sdf.closest import ClosestPoints, PadContacts
from .solver import Solution, solve

logger = logging.getLogger(__name__)


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
        self._graphs = GraphBuilder(self._closest, len(hand), self.config)
        self._T_wo: gtsam.Pose3 | None = None
        self._warm_up()

    def reset(self, T_wo: gtsam.Pose3 | None = None) -> None:
        """Forget; the next frame starts at T_wo, or at its visual pose where T_wo is None."""
        if T_wo is not None:
            require_pose(T_wo, "T_wo")
        self._T_wo = T_wo

    def update(self, measurement: Measurement) -> Estimate:
        """Fuse one frame.

        Returns:
            The estimate. Trouble with the data is an answer, in ``Estimate.status``.

        Raises:
            ValueError: The measurement has the wrong shape or names, or lacks something: a mistake of the
                program that made it.
        """
        frame = check(measurement, self.hand, self.config.use_visual_covariance)
        if frame.invalid:
            logger.warning("t = %s: not finite, so not used: %s", frame.time, frame.invalid)
            return self._without_solving(frame, "invalid")
        start = frame.T_wo_visual if self._T_wo is None else self._T_wo
        if start is None:
            return self._without_solving(frame, "waiting")
        self._closest.place(frame.T_wp, frame.touching)
        estimate = (
            self._as_seen(frame, start)
            if self.config.method == "vis"
            else self._fused(frame, start)
        )
        self._T_wo = estimate.T_wo
        return estimate

    def _warm_up(self) -> None:
        """Run one frame, so that whatever is compiled is compiled before the first real one."""
        count = len(self.hand)
        T_wp = np.tile(np.eye(4), (count, 1, 1))
        touching = np.ones(count, dtype=bool)
        self.update(Measurement(0.0, touching, T_wp=T_wp, T_wo_visual=gtsam.Pose3()))
        self.reset()

    def _fused(self, frame: Frame, start: gtsam.Pose3) -> Estimate:
        factors = self._graphs.build(frame)
        estimate = self._solved(frame, factors, start)
        if estimate.status == "lost" and self.config.recover and frame.T_wo_visual is not None:
            logger.info("t = %s: lost, starting again from vision", frame.time)
            estimate = self._solved(frame, factors, frame.T_wo_visual)
        return estimate

    def _solved(self, frame: Frame, factors: FrameGraph, start: gtsam.Pose3) -> Estimate:
        solution = solve(factors.graph, OBJECT, start, self.config)
        return self._estimate(frame, factors, start, solution)

    def _as_seen(self, frame: Frame, start: gtsam.Pose3) -> Estimate:
        """Method ``vis``: the visual pose as it is, the last one where there is none this frame."""
        T_wo = start if frame.T_wo_visual is None else frame.T_wo_visual
        values = gtsam.Values()
        values.insert(OBJECT, T_wo)
        solution = Solution(T_wo, values, 0, 0.0)
        return self._estimate(frame, self._graphs.build(frame), T_wo, solution)

    def _estimate(
        self, frame: Frame, factors: FrameGraph, start: gtsam.Pose3, solution: Solution
    ) -> Estimate:
        visual_weight = self._visual_weight(factors, solution)
        verdict = diagnose(factors, start, solution, visual_weight)
        contacts = self._closest.everywhere(solution.T_wo)
        return Estimate(
            time=frame.time,
            T_wo=solution.T_wo,
            covariance=covariance_of(verdict.information),
            status=verdict.status,
            iterations=solution.iterations,
            error=solution.error,
            visual_weight=visual_weight,
            pad_distances=contacts.distances,
            pad_weights=self._pad_weights(contacts),
            contact_points_w=self._closest.points_w(contacts),
        )

    def _visual_weight(self, factors: FrameGraph, solution: Solution) -> float:
        if factors.visual is None:
            return 0.0
        loss = factors.visual.error(solution.values)
        return welsch_weight_of_loss(loss, self.config.log_theta_vis)

    def _pad_weights(self, contacts: PadContacts) -> np.ndarray:
        if self.config.method != "vis+tac+pen":
            return np.zeros(len(self.hand))
        return tactile_weights(  # type: ignore[no-any-return]
            contacts.distances, contacts.touching, self.config.w_tac, self.config.log_theta_tac
        )

    def _without_solving(self, frame: Frame, status: Status) -> Estimate:
        """The last pose, with nothing known about it this frame."""
        count = len(self.hand)
        return Estimate(
            time=frame.time,
            T_wo=self._T_wo,
            covariance=covariance_of(np.zeros((6, 6))),
            status=status,
            iterations=0,
            error=math.nan,
            visual_weight=0.0,
            pad_distances=np.full(count, np.nan),
            pad_weights=np.zeros(count),
            contact_points_w=np.full((count, 3), np.nan),
        )
