# SPDX-License-Identifier: MIT
r"""The estimator: one factor graph a frame, solved from the previous frame's estimate (paper, section III).

The unknown is T_ho, the object in the hand. So the previous estimate is carried along with a hand that moves,

    T_wo(t) starts at T_wh(t) T_wh(t-1)^-1 T_wo(t-1),

and a right perturbation of T_ho is one of T_wo = T_wh T_ho: covariances do not change.
"""

from __future__ import annotations

import logging
import math
from dataclasses import replace
from typing import NamedTuple

import gtsam
import numpy as np

from .answer import solved_estimate, unsolved_estimate
from .calibration.calibration import Calibration
from .calibration.change import Change
from .compiled import on_disk
from .config import EstimatorConfig
from .estimate import Estimate
from .faults.watch import Watch
from .faults.words import HAND_FROZEN, TIME_WENT_BACK, VISION_TOO_LATE
from .frame import Frame, Hand, check, require_finite_pose
from .hands.pads import PadSet
from .history import SAME, History, LinearizedHand, Past
from .measurement import Measurement
from .memory import Belief
from .modes import Mode, ModeFilter
from .objects import ObjectModel
from .offsets import CalibrationPrior
from .relinearize import solved_again
from .sdf.search.compiled_search import closest_on_pads
from .solver import FrameSolver, Solved

SAME_POINT = 1e-6  # [m]

logger = logging.getLogger(__name__)


class Late(NamedTuple):
    """What became of a late visual pose.

    Attributes:
        T_ho: The pose, in the hand.
        weight: How much it counted in the frame of its instant.
    """

    T_ho: gtsam.Pose3
    weight: float


class PoseEstimator:
    """Where the object is, frame by frame.

    Poses, contacts and joints in memory: no files, no simulator. Use one thread at a time per estimator. The
    interpreter lock is held while GTSAM's optimiser runs.

    Args:
        hand: The hand with its pads; a plain ``PadSet`` needs ``Measurement.T_wp`` in every frame.
        obj: The object with its distance field.
        config: Settings; the recommended ones, ``EstimatorConfig()``, where not given.
        calibration: Where the robot's camera and its joints' zeros are. It corrects each measurement, and what it
            leaves uncertain takes the place of the configured ``joint_sigma`` and ``camera_sigma``.

    Raises:
        ValueError: An argument is of another type.
        CalibrationError: The calibration is another hand's.
    """

    def __init__(
        self,
        hand: PadSet,
        obj: ObjectModel,
        config: EstimatorConfig | None = None,
        calibration: Calibration | None = None,
    ) -> None:
        _require(hand, PadSet, "hand", "load_hand(name_or_path) or PadSet(pads) makes one")
        _require(obj, ObjectModel, "obj", "load_object(name_or_path) makes one")
        config = EstimatorConfig() if config is None else config
        _require(config, EstimatorConfig, "config", "EstimatorConfig.tuned() is one")
        if calibration is not None:
            _require_calibration(calibration, hand)
        self.hand = hand
        self.obj = obj
        self.config = config
        self.calibration = calibration
        self._solver = FrameSolver(hand, obj.sdf, config)
        self.reset()
        self._warm_up()

    def reset(self, T_wo: gtsam.Pose3 | None = None) -> None:
        """Forget; the next frame starts at T_wo, or at its visual pose where T_wo is None.

        Raises:
            ValueError: T_wo is no finite ``gtsam.Pose3``.
        """
        if T_wo is not None:
            require_finite_pose(T_wo, "T_wo")
        self._T_wo_given = T_wo  # where the next frame is to start
        self._hand: Hand | None = None  # of the last frame
        self._belief: Belief | None = None  # after the last frame
        self._history = History()
        self._modes = ModeFilter(self.config)
        self._watch = Watch(self.hand, self.obj.sdf, self.config)
        self._prior: CalibrationPrior | None = None  # known once the hand is seen

    def recalibrate(self, calibration: Calibration) -> None:
        """Go on with another calibration; what is remembered moves to where it would be with it.

        Args:
            calibration: This robot's, in place of the one until now, or of none.

        Raises:
            ValueError: Its camera turns about another point than until now.
            CalibrationError: It is another hand's.
        """
        _require_calibration(calibration, self.hand)
        until_now = self.calibration.prior if self.calibration is not None else self._prior
        if until_now is not None and not np.allclose(
            until_now.camera_origin, calibration.camera_origin, rtol=0.0, atol=SAME_POINT
        ):
            raise ValueError(
                f"the calibration's camera must turn about {until_now.camera_origin}, as until now, got "
                f"{calibration.camera_origin}; make a new estimator for it"
            )
        change = Change(self.hand, self.calibration, calibration)
        self.calibration = calibration
        self._belief = None if self._belief is None else change.belief(self._belief)
        self._history.recalibrate(change)
        self._watch.recalibrate(change)
        if self._hand is not None:
            moved = change.hand(self._hand)
            self._modes.displace(moved.T_hp[:, :3, 3] - self._hand.T_hp[:, :3, 3])
            self._hand = moved

    def update(self, measurement: Measurement) -> Estimate:
        """Fuse one frame.

        Returns:
            The estimate. Trouble with the data is an answer, in ``Estimate.status`` and ``Estimate.faults``.

        Raises:
            ValueError: The measurement has the wrong shape or names, or lacks something: a mistake of the
                program that made it.
        """
        _require(measurement, Measurement, "measurement", "Measurement(time, contacts, ...) is one")
        if self.calibration is not None:
            measurement = self.calibration.corrected(measurement)
        frame = check(measurement, self.hand, self.config.use_visual_covariance, self._hand)
        if not math.isfinite(frame.time):
            return unsolved_estimate(frame, "invalid", self._last_T_wo())
        frame = self._watch.before(frame)
        if self._belief is not None and frame.time < self._belief.time:
            return self._out_of_order(frame)
        if HAND_FROZEN in frame.faults and frame.T_ho_visual is not None:
            self._belief = None  # it was about another hand
        late = None
        if measurement.visual_time is not None:
            frame, late = self._fuse_late(frame, measurement.visual_time)
        if frame.pads_known:
            self._hand = Hand(frame.T_wh, frame.T_hp, frame.joints)
        mode = self._modes.mode(frame.time, frame.touching, frame.T_hp)
        solved = self._step(frame, mode, self._belief)
        self._history.append(_past(frame, mode, self._belief, solved))
        if solved is None:
            return unsolved_estimate(frame, "waiting", self._last_T_wo())
        self._belief, self._T_wo_given = solved.belief, None
        estimate = self._estimate(frame, mode, solved)
        if late is not None:  # judged in its own frame
            estimate = replace(estimate, visual_weight=late.weight)
            frame = frame._replace(T_ho_visual=late.T_ho)
        return self._watch.after(frame, estimate)

    def _step(self, frame: Frame, mode: Mode, before: Belief | None) -> Solved | None:
        """Solve one frame from what was believed before it; None where there is nowhere to start."""
        start = self._start(frame, before)
        if start is None:
            return None
        prior = self._calibration_prior(frame)
        return self._solver.solve(frame, mode, before, start, prior)

    def _start(self, frame: Frame, before: Belief | None) -> gtsam.Pose3 | None:
        """Where the solver starts: at the last pose in the hand, or at the visual one."""
        if before is not None:
            return before.T_ho
        if self._T_wo_given is not None:
            return frame.T_wh.between(self._T_wo_given)
        return frame.T_ho_visual

    def _calibration_prior(self, frame: Frame) -> CalibrationPrior:
        """What is known of the robot's offsets; its camera turns about where the hand was first."""
        if self.calibration is not None:
            return self.calibration.prior
        if self._prior is None:
            units = getattr(self.hand, "zero_units", np.zeros(0))
            origin = frame.T_wh.translation()
            self._prior = CalibrationPrior.of_config(self.config, units, origin)
        return self._prior

    def _fuse_late(self, frame: Frame, visual_time: float) -> tuple[Frame, Late | None]:
        """Fuse a visual pose at its own instant, which is in the past.

        Returns:
            The frame, which is left without it, and what became of it; the frame as it is and None where the pose is
            not late.
        """
        if frame.T_ho_visual is None or visual_time >= frame.time - SAME:
            return frame, None
        unseen = frame._replace(T_ho_visual=None, visual_covariance=None)
        late = self._history.at_its_instant(frame, visual_time)
        if late is None or late.T_ho_visual is None:
            return unseen._replace(faults=(*frame.faults, VISION_TOO_LATE)), None
        if not self.config.memory:  # nothing is remembered that the pose could have changed
            return frame._replace(T_ho_visual=late.T_ho_visual), None
        return unseen, Late(late.T_ho_visual, self._solve_again(late))

    def _solve_again(self, late: Frame) -> float:
        """Solve a late pose's frame again, and those after it from there; how much the pose counted in its own."""
        again = self._history.rewind(late, self._belief)
        self._belief = again[0].before
        weight = 0.0
        for k, past in enumerate(again):
            past, counted = self._again(past)
            self._history.append(past)
            self._belief = self._belief if past.after is None else past.after
            weight = counted if k == 0 else weight
        return weight

    def _again(self, past: Past) -> tuple[Past, float]:
        """A frame solved again from what is believed now, and how much its visual pose counted."""
        prior = self._calibration_prior(past.frame)
        linearize = self._solver.linearized_hand
        if again := solved_again(past, self._belief, prior, self.config, linearize):
            return again
        solved = self._step(past.frame, past.mode, self._belief)
        weight = 0.0 if solved is None else solved.fit.visual_weight
        return _past(past.frame, past.mode, self._belief, solved), weight

    def _out_of_order(self, frame: Frame) -> Estimate:
        """A frame that is earlier than the last one: by itself, and nothing is remembered of it."""
        assert self._belief is not None
        logger.warning("t = %s: earlier than the frame before it", frame.time)
        frame = frame._replace(faults=(*frame.faults, TIME_WENT_BACK))
        solved = self._step(frame, "free", Belief(frame.time, self._belief.T_ho))
        assert solved is not None
        return self._estimate(frame, "free", solved)

    def _estimate(self, frame: Frame, mode: Mode, solved: Solved) -> Estimate:
        prior = self._calibration_prior(frame)
        return solved_estimate(frame, mode, solved, prior, self.config)

    def _last_T_wo(self) -> gtsam.Pose3 | None:
        if self._belief is None or self._hand is None:
            return self._T_wo_given
        return self._hand.T_wh.compose(self._belief.T_ho)

    def _warm_up(self) -> None:
        """Run one frame, so that whatever is compiled is compiled before the first real one."""
        if not on_disk(closest_on_pads):
            logger.warning("compiling for this machine, once; this takes some seconds")
        count = len(self.hand)
        T_wp = np.tile(np.eye(4), (count, 1, 1))
        touching = np.ones(count, dtype=bool)
        self.update(Measurement(0.0, touching, T_wp=T_wp, T_wo_visual=gtsam.Pose3()))
        self.reset()


def _past(frame: Frame, mode: Mode, before: Belief | None, solved: Solved | None) -> Past:
    if solved is None:
        return Past(frame, mode, before)
    hand = LinearizedHand(solved.fit.T_ho, solved.hand)
    return Past(frame, mode, before, solved.belief, hand)


def _require_calibration(calibration: Calibration, hand: PadSet) -> None:
    _require(calibration, Calibration, "calibration", "Calibration.from_yaml(path) reads one")
    calibration.check_hand(hand)


def _require(value: object, kind: type, name: str, remedy: str) -> None:
    if not isinstance(value, kind):
        raise ValueError(
            f"{name} must be a {kind.__name__}, got a {type(value).__name__} ({value!r:.60}): {remedy}"
        )
