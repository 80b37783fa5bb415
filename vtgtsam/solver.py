# SPDX-License-Identifier: MIT
"""One frame solved: its factor graph, what is remembered as one more factor, and the LM optimiser from a start.

Three ways, by method: ``vis`` takes the visual pose as it is; a memoryless method solves the frame by itself, and
again from vision where it is lost; with memory the frames before hold the pose, until vision has been refused for long.
"""

from __future__ import annotations

import logging
from typing import Any, NamedTuple

import gtsam
from gtsam.symbol_shorthand import Q, X

from .config import EstimatorConfig
from .doubt import Doubt, otherwise
from .frame import Frame
from .graph import FrameFactors, frame_factors, total_covariance
from .hands.pads import PadSet
from .history import LinearizedHand
from .knowledge import FrameInformation, Knowledge, fused, hand_information, vision_information
from .memory import (
    Belief,
    Expectation,
    expectation,
    may_take_over,
    refused_since,
    with_vision,
)
from .modes import Mode
from .offsets import CalibrationPrior
from .optimize import Solution, optimize
from .sdf.grid import GridSdf
from .sdf.search import ClosestPoints
from .status import Fit, is_lost, visual_weight

OBJECT = X(0)  # key of T_ho
ZEROS = Q(0)  # key of the joints' zeros dq

# By so much cost must touch prefer a pose to which vision has jumped: what is held does not jump.
TOUCH_SPEAKS = 3.0

logger = logging.getLogger(__name__)


class Solved(NamedTuple):
    """A solved frame.

    Attributes:
        fit: Where the solver ended.
        hand: What the hand says of the pose there.
        knowledge: What is known of it, vision and memory included.
        belief: What is remembered of it.
    """

    fit: Fit
    hand: FrameInformation
    knowledge: Knowledge
    belief: Belief


class FrameSolver:
    """Solves frames of one hand and one object.

    Args:
        hand: The hand's pads.
        sdf: The object's distance field.
        config: Settings.
    """

    def __init__(self, hand: PadSet, sdf: GridSdf, config: EstimatorConfig) -> None:
        self._hand = hand
        self._sdf = sdf
        self._config = config
        self._closest = ClosestPoints(hand, sdf)
        # From a perturbation of the object frame to that of a frame in the middle of the object.
        self._to_center = gtsam.Pose3(gtsam.Rot3(), -(sdf.lower + sdf.upper) / 2.0).AdjointMap()

    def solve(
        self,
        frame: Frame,
        mode: Mode,
        before: Belief | None,
        start: gtsam.Pose3,
        prior: CalibrationPrior,
    ) -> Solved:
        """The frame, solved.

        Args:
            frame: The frame.
            mode: How the object moves in the hand.
            before: What was believed before it.
            start: T_ho that the optimiser starts from.
            prior: What is known of the robot's offsets.
        """
        expected = None
        if self._config.memory:
            expected = expectation(before, frame, mode, self._config)
            fit, expected = self._remembered(frame, start, prior, before, expected)
        elif self._config.method == "vis":
            fit = self._as_seen(frame, self._factors(frame, start, prior), start)
        else:
            fit = self._fused(frame, self._factors(frame, start, prior), start)
        hand = hand_information(fit.factors, fit.values, prior)
        doubt = self._doubt(frame, prior, before, fit) if self._config.memory else Doubt()
        says = hand.doubted(doubt.kappa, prior)
        if fit.factors.visual is not None:
            says = says.plus(_vision(frame, prior, fit))
        knowledge = fused(says) if expected is None else expected.posterior(says)
        kept = knowledge if self._config.memory else None
        belief = Belief(frame.time, fit.T_ho, kept, offsets_share=hand.offsets_share, doubt=doubt)
        belief = with_vision(belief, before, frame, fit.visual_weight, self._config)
        return Solved(fit, hand, knowledge, belief)

    def _doubt(
        self, frame: Frame, prior: CalibrationPrior, before: Belief | None, fit: Fit
    ) -> Doubt:
        """How linear the frame is by itself, from the pose where it was solved on."""
        doubt = Doubt() if before is None else before.doubt
        if frame.T_ho_visual is None or fit.visual_weight < self._config.refused_weight:
            return doubt
        covariance = total_covariance(frame, self._config, prior)
        centre = self._to_center
        if not frame.touching.any() or not doubt.is_due(frame.time, centre @ covariance @ centre.T):
            return doubt
        factors = self._factors(frame, fit.T_ho, prior)
        alone = self._solved(factors, factors.graph(), fit.T_ho)
        says = hand_information(factors, alone.values, prior).plus(_vision(frame, prior, alone))
        there = otherwise(frame.T_ho_visual, covariance, frame.time)
        factors = self._factors(frame._replace(T_ho_visual=there), there, prior)
        other = self._solved(factors, factors.graph(), there)
        off = gtsam.Pose3.Logmap(alone.T_ho.between(other.T_ho))
        squared = float(off @ says.information @ off) / 6.0
        return doubt.after(frame.time, squared, other.error - alone.error)

    def linearized_hand(
        self, frame: Frame, T_ho: gtsam.Pose3, prior: CalibrationPrior
    ) -> LinearizedHand:
        """What a frame's hand says of the pose, linearized at ``T_ho``."""
        factors = self._factors(frame, T_ho, prior)
        values = _at(T_ho)
        if factors.zeros is not None:
            values.insert(ZEROS, factors.zeros.prior())
        return LinearizedHand(T_ho, hand_information(factors, values, prior))

    def _factors(
        self,
        frame: Frame,
        start: gtsam.Pose3,
        prior: CalibrationPrior,
        images_alike: float = 1.0,
    ) -> FrameFactors:
        return frame_factors(
            frame, self._closest, OBJECT, self._config, prior, ZEROS, start, images_alike
        )

    def _as_seen(self, frame: Frame, factors: FrameFactors, start: gtsam.Pose3) -> Fit:
        """Method ``vis``: the visual pose as it is; where there is none the last one, carried with the hand."""
        T_ho = start if frame.T_ho_visual is None else frame.T_ho_visual
        return self._fit(factors, Solution(_at(T_ho), iterations=0, error=0.0), moved=False)

    def _fused(self, frame: Frame, factors: FrameFactors, start: gtsam.Pose3) -> Fit:
        """The frame by itself, from the last estimate on."""
        fit = self._solved(factors, factors.graph(), start)
        if self._config.recover and frame.T_ho_visual is not None and is_lost(fit):
            logger.info("t = %s: lost, starting again from vision", frame.time)
            return self._solved(factors, factors.graph(), frame.T_ho_visual)
        return fit

    def _remembered(
        self,
        frame: Frame,
        start: gtsam.Pose3,
        prior: CalibrationPrior,
        before: Belief | None,
        expected: Expectation | None,
    ) -> tuple[Fit, Expectation | None]:
        """The frame and what the frames before say; vision takes over where it was refused for long."""
        alike = 1.0 if expected is None else expected.images_alike
        factors = self._factors(frame, start, prior, alike)
        graph = factors.graph()
        if expected is not None:
            graph.push_back(expected.factor(OBJECT))
        fit = self._solved(factors, graph, start)
        refused = refused_since(before, frame, fit.visual_weight, self._config)
        if expected is None or not may_take_over(frame, refused, self._config):
            return fit, expected
        assert frame.T_ho_visual is not None
        if alike > 1.0:  # by itself it is the first that says so
            factors = self._factors(frame, start, prior)
        alone = self._solved(factors, factors.graph(), frame.T_ho_visual)
        if frame.touching.any() and not _better(factors, alone, fit, frame.suspect):
            return fit, expected
        logger.info("t = %s: vision was refused for long, starting again from it", frame.time)
        return alone, None

    def _solved(
        self, factors: FrameFactors, graph: gtsam.NonlinearFactorGraph, start: gtsam.Pose3
    ) -> Fit:
        values = _at(start)
        if factors.zeros is not None:
            values.insert(ZEROS, factors.zeros.prior())
        solution = Solution(values, iterations=0, error=0.0)
        if not graph.empty():
            solution = optimize(graph, values, self._config)
        moved = not solution.values.atPose3(OBJECT).equals(start, 0.0)
        return self._fit(factors, solution, moved)

    def _fit(self, factors: FrameFactors, solution: Solution, moved: bool) -> Fit:
        log_theta = self._config.visual_log_theta
        weight = visual_weight(factors.visual, solution.values, log_theta, factors.images_alike)
        return Fit(factors, *solution, moved, weight)

    def __getstate__(self) -> dict[str, Any]:
        """What a copy is made from: it searches with arrays of its own."""
        return {name: value for name, value in self.__dict__.items() if name != "_closest"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._closest = ClosestPoints(self._hand, self._sdf)


def _at(T_ho: gtsam.Pose3) -> gtsam.Values:
    values = gtsam.Values()
    values.insert(OBJECT, pose3=T_ho)  # by name: GTSAM finds the overload sooner
    return values


def _vision(frame: Frame, prior: CalibrationPrior, fit: Fit) -> FrameInformation:
    """What the visual pose says where the frame was solved."""
    assert fit.factors.visual is not None and frame.T_wo_visual is not None
    return vision_information(fit.factors.visual, fit.values, prior, frame.T_wo_visual)


def _better(factors: FrameFactors, alone: Fit, fit: Fit, suspect: bool) -> bool:
    """Whether a frame explains itself better by vision's pose; by touch alone where vision is suspect."""
    if not suspect:
        return bool(alone.error < factors.graph().error(fit.values))
    touch = factors.hand_graph()
    return bool(touch.error(alone.values) < touch.error(fit.values) - TOUCH_SPEAKS)
