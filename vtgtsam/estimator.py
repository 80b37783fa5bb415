# SPDX-License-Identifier: MIT
r"""The estimator: one factor graph a frame, solved from the previous frame's estimate (paper, section III).

The unknown is T_ho, the object in the hand. So the previous estimate is carried along with a hand that moves,

    T_wo(t) starts at T_wh(t) T_wh(t-1)^-1 T_wo(t-1),

and a right perturbation of T_ho is one of T_wo = T_wh T_ho: covariances do not change.
"""

from __future__ import annotations

import logging
import math
from typing import Any

import gtsam
import numpy as np
from gtsam.symbol_shorthand import X

from .compiled import on_disk
from .config import EstimatorConfig
from .covariance import covariance_of
from .estimate import Estimate, Status
from .factors.noise import welsch_weight
from .frame import Frame, Hand, check, require_finite_pose
from .graph import FrameFactors, frame_factors
from .hands.pads import PadSet
from .measurement import Measurement
from .objects import ObjectModel
from .optimize import Solution, optimize
from .sdf.search import ClosestPoints
from .sdf.search.compiled_search import closest_on_pads
from .status import status_of

OBJECT = X(0)  # key of T_ho

logger = logging.getLogger(__name__)


class PoseEstimator:
    """Where the object is, frame by frame.

    Poses, contacts and joints in memory: no files, no simulator. Use one thread at a time per estimator. The
    interpreter lock is held while GTSAM's optimiser runs.

    Args:
        hand: The hand with its pads; a plain ``PadSet`` needs ``Measurement.T_wp`` in every frame.
        obj: The object with its distance field.
        config: Settings; the recommended ones, ``EstimatorConfig()``, where not given.

    Raises:
        ValueError: An argument is of another type.
    """

    def __init__(
        self, hand: PadSet, obj: ObjectModel, config: EstimatorConfig | None = None
    ) -> None:
        _require(hand, PadSet, "hand", "load_hand(name_or_path) or PadSet(pads) makes one")
        _require(obj, ObjectModel, "obj", "load_object(name_or_path) makes one")
        config = EstimatorConfig() if config is None else config
        _require(config, EstimatorConfig, "config", "EstimatorConfig.tuned() is one")
        self.hand = hand
        self.obj = obj
        self.config = config
        self._closest = ClosestPoints(hand, obj.sdf)
        self._hand: Hand | None = None  # of the last frame
        self._T_ho: gtsam.Pose3 | None = None  # of the last frame
        self._T_wo_given: gtsam.Pose3 | None = None  # where the next frame is to start
        self._warm_up()

    def reset(self, T_wo: gtsam.Pose3 | None = None) -> None:
        """Forget; the next frame starts at T_wo, or at its visual pose where T_wo is None.

        Raises:
            ValueError: T_wo is no finite ``gtsam.Pose3``.
        """
        if T_wo is not None:
            require_finite_pose(T_wo, "T_wo")
        self._hand = self._T_ho = None
        self._T_wo_given = T_wo

    def update(self, measurement: Measurement) -> Estimate:
        """Fuse one frame.

        Returns:
            The estimate. Trouble with the data is an answer, in ``Estimate.status``.

        Raises:
            ValueError: The measurement has the wrong shape or names, or lacks something: a mistake of the
                program that made it.
        """
        _require(measurement, Measurement, "measurement", "Measurement(time, contacts, ...) is one")
        frame = check(measurement, self.hand, self.config.use_visual_covariance, self._hand)
        if frame.invalid:
            logger.warning("t = %s: not finite, so not used: %s", frame.time, frame.invalid)
            return self._without_solving(frame, "invalid")
        self._hand = Hand(frame.T_wh, frame.T_hp)
        start = self._start(frame)
        if start is None:
            return self._without_solving(frame, "waiting")
        factors = frame_factors(frame, self._closest, OBJECT, self.config)
        solved = self._as_seen if self.config.method == "vis" else self._fused
        estimate = solved(frame, factors, start)
        self._T_wo_given = None
        return estimate

    def _start(self, frame: Frame) -> gtsam.Pose3 | None:
        """Where the solver starts: at the last pose in the hand, or at the visual one."""
        if self._T_wo_given is not None:
            return frame.T_wh.between(self._T_wo_given)
        return frame.T_ho_visual if self._T_ho is None else self._T_ho

    def _fused(self, frame: Frame, factors: FrameFactors, start: gtsam.Pose3) -> Estimate:
        estimate = self._solved(frame, factors, start)
        if estimate.status == "lost" and self.config.recover and frame.T_ho_visual is not None:
            logger.info("t = %s: lost, starting again from vision", frame.time)
            return self._solved(frame, factors, frame.T_ho_visual)
        return estimate

    def _solved(self, frame: Frame, factors: FrameFactors, start: gtsam.Pose3) -> Estimate:
        graph = factors.graph()
        solution = optimize(graph, _at(start), self.config)
        return self._estimate(frame, factors, graph, start, solution)

    def _as_seen(self, frame: Frame, factors: FrameFactors, start: gtsam.Pose3) -> Estimate:
        """Method ``vis``: the visual pose as it is; where there is none the last one, carried with the hand."""
        T_ho = start if frame.T_ho_visual is None else frame.T_ho_visual
        solution = Solution(_at(T_ho), iterations=0, error=0.0)
        return self._estimate(frame, factors, factors.graph(), T_ho, solution)

    def _estimate(
        self,
        frame: Frame,
        factors: FrameFactors,
        graph: gtsam.NonlinearFactorGraph,
        start: gtsam.Pose3,
        solution: Solution,
    ) -> Estimate:
        """What is known where the solver ended."""
        self._T_ho = T_ho = solution.values.atPose3(OBJECT)
        normal_equations = _normal_equations(graph, solution.values)
        visual_weight = self._visual_weight(factors, solution.values)
        stuck = T_ho.equals(start, 0.0)
        contacts = factors.pads.everywhere(T_ho)
        return Estimate(
            time=frame.time,
            T_wo=frame.T_wh.compose(T_ho),
            covariance=covariance_of(normal_equations[0]),
            status=status_of(factors, solution.values, visual_weight, normal_equations, stuck),
            iterations=solution.iterations,
            error=solution.error,
            visual_weight=visual_weight,
            pad_distances=contacts.distances,
            pad_weights=self._pad_weights(contacts.distances, frame.touching),
            contact_points_w=_moved(frame.T_wh, factors.pads.points_h(contacts)),
        )

    def _visual_weight(self, factors: FrameFactors, values: gtsam.Values) -> float:
        if factors.visual is None:
            return 0.0
        theta = math.exp(self.config.log_theta_vis)
        return max(0.0, 1.0 - 2.0 * factors.visual.error(values) / theta)  # rho' = 1 - rho / theta

    def _pad_weights(self, distances: np.ndarray, touching: np.ndarray) -> np.ndarray:
        if self.config.method != "vis+tac+pen":
            return np.zeros(len(distances))
        squared = self.config.w_tac * np.square(np.maximum(distances, 0.0))
        weights: np.ndarray = touching * welsch_weight(squared, self.config.log_theta_tac)
        return weights

    def _without_solving(self, frame: Frame, status: Status) -> Estimate:
        """The last pose, with nothing known about it this frame."""
        count = len(self.hand)
        return Estimate(
            time=frame.time,
            T_wo=self._last_T_wo(),
            covariance=covariance_of(np.zeros((6, 6))),
            status=status,
            iterations=0,
            error=math.nan,
            visual_weight=0.0,
            pad_distances=np.full(count, np.nan),
            pad_weights=np.zeros(count),
            contact_points_w=np.full((count, 3), np.nan),
        )

    def _last_T_wo(self) -> gtsam.Pose3 | None:
        if self._T_ho is None or self._hand is None:
            return self._T_wo_given
        return self._hand.T_wh.compose(self._T_ho)

    def _warm_up(self) -> None:
        """Run one frame, so that whatever is compiled is compiled before the first real one."""
        if not on_disk(closest_on_pads):
            logger.warning("compiling for this machine, once; this takes some seconds")
        count = len(self.hand)
        T_wp = np.tile(np.eye(4), (count, 1, 1))
        touching = np.ones(count, dtype=bool)
        self.update(Measurement(0.0, touching, T_wp=T_wp, T_wo_visual=gtsam.Pose3()))
        self.reset()

    def __getstate__(self) -> dict[str, Any]:
        """What a copy is made from: it searches with arrays of its own."""
        return {name: value for name, value in self.__dict__.items() if name != "_closest"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._closest = ClosestPoints(self.hand, self.obj.sdf)


def _at(T_ho: gtsam.Pose3) -> gtsam.Values:
    values = gtsam.Values()
    values.insert(OBJECT, pose3=T_ho)  # by name: GTSAM finds the overload sooner
    return values


def _normal_equations(
    graph: gtsam.NonlinearFactorGraph, values: gtsam.Values
) -> tuple[np.ndarray, np.ndarray]:
    """J'J (6, 6) and -J'r (6,) of a graph on one pose; robust losses count with the weights they leave."""
    if graph.empty():
        return np.zeros((6, 6)), np.zeros(6)
    information, gradient = graph.linearize(values).hessian()
    return information, gradient


def _moved(T: gtsam.Pose3, points: np.ndarray) -> np.ndarray:
    """Points (N, 3), moved by T."""
    moved: np.ndarray = T.transformFrom(points.T).T
    return moved


def _require(value: object, kind: type, name: str, remedy: str) -> None:
    if not isinstance(value, kind):
        raise ValueError(
            f"{name} must be a {kind.__name__}, got a {type(value).__name__} ({value!r:.60}): {remedy}"
        )
