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
from gtsam.symbol_shorthand import Q, X

from .compiled import on_disk
from .config import EstimatorConfig
from .covariance import covariance_of
from .estimate import Estimate, Status
from .factors.noise import welsch_weight
from .frame import Frame, Hand, check, require_finite_pose
from .graph import FrameFactors, frame_factors
from .hands.pads import PadSet
from .knowledge import frame_information, fused
from .measurement import Measurement
from .memory import Expectation, Memory
from .objects import ObjectModel
from .offsets import CalibrationPrior
from .optimize import Solution, optimize
from .sdf.search import ClosestPoints, closest_on_pads
from .status import Fit, is_lost, status_of, visual_weight

OBJECT = X(0)  # key of T_ho
ZEROS = Q(0)  # key of the joints' zeros dq

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
        self.reset()
        self._warm_up()

    def reset(self, T_wo: gtsam.Pose3 | None = None) -> None:
        """Forget; the next frame starts at T_wo, or at its visual pose where T_wo is None.

        Raises:
            ValueError: T_wo is no finite ``gtsam.Pose3``.
        """
        if T_wo is not None:
            require_finite_pose(T_wo, "T_wo")
        self._hand: Hand | None = None  # of the last frame
        self._T_ho: gtsam.Pose3 | None = None  # of the last frame
        self._T_wo_given = T_wo  # where the next frame is to start
        self._prior: CalibrationPrior | None = None  # known once the hand is seen
        self._memory = Memory(self.config)

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
        self._hand = Hand(frame.T_wh, frame.T_hp, frame.joints)
        start = self._start(frame)
        if start is None:
            return self._without_solving(frame, "waiting")
        prior = self._calibration_prior(frame)
        if self.config.method == "vis":
            fit, expected = self._as_seen(frame, start), None
        elif self.config.memory:
            fit, expected = self._remembered(frame, start)
        else:
            fit, expected = self._fused(frame, start), None
        self._T_ho, self._T_wo_given = fit.T_ho, None
        return self._estimate(frame, fit, prior, expected)

    def _start(self, frame: Frame) -> gtsam.Pose3 | None:
        """Where the solver starts: at the last pose in the hand, or at the visual one."""
        if self._T_wo_given is not None:
            return frame.T_wh.between(self._T_wo_given)
        return frame.T_ho_visual if self._T_ho is None else self._T_ho

    def _calibration_prior(self, frame: Frame) -> CalibrationPrior:
        """What is known of the robot's offsets; its camera turns about where the hand was first."""
        if self._prior is None:
            joints = 0 if frame.joints is None else len(frame.joints)
            origin = frame.T_wh.translation()
            self._prior = CalibrationPrior.of_config(self.config, joints, origin)
        return self._prior

    def _as_seen(self, frame: Frame, start: gtsam.Pose3) -> Fit:
        """Method ``vis``: the visual pose as it is; where there is none the last one, carried with the hand."""
        T_ho = start if frame.T_ho_visual is None else frame.T_ho_visual
        factors = self._factors(frame, T_ho)
        return self._fit(factors, Solution(_at(T_ho), iterations=0, error=0.0), moved=False)

    def _fused(self, frame: Frame, start: gtsam.Pose3) -> Fit:
        """The frame by itself, from the last estimate on."""
        factors = self._factors(frame, start)
        fit = self._solved(factors, factors.graph(), start)
        if self.config.recover and frame.T_ho_visual is not None and is_lost(fit):
            logger.info("t = %s: lost, starting again from vision", frame.time)
            return self._solved(factors, factors.graph(), frame.T_ho_visual)
        return fit

    def _remembered(self, frame: Frame, start: gtsam.Pose3) -> tuple[Fit, Expectation]:
        """The frame and what the frames before say; vision takes over where it is refused for long."""
        expected = self._memory.expect(frame)
        factors = self._factors(frame, start)
        graph = factors.graph()
        if expected.before is not None:
            graph.push_back(expected.factor(OBJECT))
        fit = self._solved(factors, graph, start)
        if self._memory.refuses(frame, fit.visual_weight) and frame.T_ho_visual is not None:
            alone = self._solved(factors, factors.graph(), frame.T_ho_visual)
            if not frame.touching.any() or alone.error < factors.graph().error(fit.values):
                logger.info("t = %s: vision was refused for long, starting again", frame.time)
                self._memory.restarted()
                return alone, expected.forgotten()
        return fit, expected

    def _factors(self, frame: Frame, T_ho: gtsam.Pose3) -> FrameFactors:
        return frame_factors(frame, self._closest, OBJECT, self.config, self._prior, ZEROS, T_ho)

    def _solved(
        self, factors: FrameFactors, graph: gtsam.NonlinearFactorGraph, start: gtsam.Pose3
    ) -> Fit:
        values = _at(start)
        if factors.zeros is not None:
            values.insert(ZEROS, factors.zeros.prior())
        solution = optimize(graph, values, self.config)
        moved = not solution.values.atPose3(OBJECT).equals(start, 0.0)
        return self._fit(factors, solution, moved)

    def _fit(self, factors: FrameFactors, solution: Solution, moved: bool) -> Fit:
        log_theta = (
            self.config.log_theta_vis_mem if self.config.memory else self.config.log_theta_vis
        )
        weight = visual_weight(factors, solution.values, log_theta)
        return Fit(factors, *solution, moved, weight)

    def _estimate(
        self, frame: Frame, fit: Fit, prior: CalibrationPrior, expected: Expectation | None
    ) -> Estimate:
        """What is known where the solver ended."""
        seen = None if frame.T_ho_visual is None else frame.T_wh.compose(frame.T_ho_visual)
        information = frame_information(fit.factors, fit.values, prior, seen)
        knowledge = fused(information) if expected is None else expected.posterior(information)
        if expected is not None:
            self._memory.keep(frame.time, fit.T_ho, knowledge)
        contacts = fit.factors.pads.everywhere(fit.T_ho)
        return Estimate(
            time=frame.time,
            T_wo=frame.T_wh.compose(fit.T_ho),
            covariance=knowledge.covariance(prior),
            status=status_of(fit, knowledge.information),
            iterations=fit.iterations,
            error=fit.error,
            visual_weight=fit.visual_weight,
            pad_distances=contacts.distances,
            pad_weights=self._pad_weights(contacts.distances, frame.touching),
            contact_points_w=_moved(frame.T_wh, fit.factors.pads.points_h(contacts)),
        )

    def _pad_weights(self, distances: np.ndarray, touching: np.ndarray) -> np.ndarray:
        if "tac" not in self.config.method:
            return np.zeros(len(distances))
        squared = self.config.w_tac * np.square(np.maximum(distances, 0.0))
        return touching * welsch_weight(squared, self.config.log_theta_tac)

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


def _moved(T: gtsam.Pose3, points: np.ndarray) -> np.ndarray:
    """Points (N, 3), moved by T."""
    moved: np.ndarray = T.transformFrom(points.T).T
    return moved


def _require(value: object, kind: type, name: str, remedy: str) -> None:
    if not isinstance(value, kind):
        raise ValueError(
            f"{name} must be a {kind.__name__}, got a {type(value).__name__} ({value!r:.60}): {remedy}"
        )
