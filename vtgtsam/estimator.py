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
from typing import Any

import gtsam
import numpy as np

from .conclusion import conclude
from .config import EstimatorConfig
from .covariance import covariance_of
from .diagnosis import diagnose
from .estimate import Estimate, Status
from .frame import Frame, check, matrix_of, require_finite_pose
from .hands.pads import PadSet
from .measurement import Measurement
from .objective import Objective
from .objects import ObjectModel
from .solvers import Solution, new_solver

logger = logging.getLogger(__name__)


class PoseEstimator:
    """Where the object is, frame by frame.

    Poses, contacts and joints in memory: no files, no simulator. Use one thread at a time per estimator. The
    interpreter lock is let go of during compiled steps and held while GTSAM's optimiser runs (``config.engine``).

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
        self._objective = Objective(hand, obj, self.config)
        self._solve = new_solver(self._objective, self.config)
        self._T_wo: gtsam.Pose3 | None = None
        self._T_start: np.ndarray | None = None  # the same pose
        self._warm_up()

    def reset(self, T_wo: gtsam.Pose3 | None = None) -> None:
        """Forget; the next frame starts at T_wo, or at its visual pose where T_wo is None.

        Raises:
            ValueError: T_wo is no finite ``gtsam.Pose3``.
        """
        if T_wo is not None:
            require_finite_pose(T_wo, "T_wo")
        self._T_wo = T_wo
        self._T_start = None if T_wo is None else matrix_of(T_wo)

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
        start = frame.visual_matrix if self._T_start is None else self._T_start
        if start is None:
            return self._without_solving(frame, "waiting")
        self._objective.place(frame)
        if self.config.method == "vis":
            solution, estimate = self._as_seen(frame, start)
        else:
            solution, estimate = self._fused(frame, start)
        self._T_wo, self._T_start = estimate.T_wo, solution.T_wo
        return estimate

    def __getstate__(self) -> dict[str, Any]:
        """What a copy is made from: it searches and solves with arrays of its own."""
        start = None if self._T_start is None else self._T_start.copy()
        return {"hand": self.hand, "obj": self.obj, "config": self.config, "start": start}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__init__(state["hand"], state["obj"], state["config"])  # type: ignore[misc]
        self.reset(None if state["start"] is None else gtsam.Pose3(state["start"]))

    def _warm_up(self) -> None:
        """Run one frame, so that whatever is compiled is compiled before the first real one."""
        count = len(self.hand)
        T_wp = np.tile(np.eye(4), (count, 1, 1))
        touching = np.ones(count, dtype=bool)
        measurement = Measurement(
            0.0, touching, T_wp=T_wp, T_wo_visual=gtsam.Pose3(), visual_sigma=(1.0, 1.0)
        )
        self.update(measurement)
        self.reset()

    def _fused(self, frame: Frame, start: np.ndarray) -> tuple[Solution, Estimate]:
        solution, estimate = self._solved(frame, start)
        if estimate.status == "lost" and self.config.recover and frame.visual_matrix is not None:
            logger.info("t = %s: lost, starting again from vision", frame.time)
            return self._solved(frame, frame.visual_matrix)
        return solution, estimate

    def _solved(self, frame: Frame, start: np.ndarray) -> tuple[Solution, Estimate]:
        solution = self._solve(frame, start)
        return solution, self._estimate(frame, solution)

    def _as_seen(self, frame: Frame, start: np.ndarray) -> tuple[Solution, Estimate]:
        """Method ``vis``: the visual pose as it is, the last one where there is none this frame."""
        T_wo = start if frame.visual_matrix is None else frame.visual_matrix
        solution = Solution(T_wo, moved=False, iterations=0, error=0.0)
        return solution, self._estimate(frame, solution)

    def _estimate(self, frame: Frame, solution: Solution) -> Estimate:
        known = conclude(self._objective, solution.T_wo)
        seen = frame.visual_matrix is not None
        return Estimate(
            time=frame.time,
            T_wo=gtsam.Pose3(solution.T_wo),
            covariance=known.covariance,
            status=diagnose(self._objective, solution, known, seen),
            iterations=solution.iterations,
            error=solution.error,
            visual_weight=known.visual_weight,
            pad_distances=known.pad_distances,
            pad_weights=known.pad_weights,
            contact_points_w=known.contact_points_w,
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
