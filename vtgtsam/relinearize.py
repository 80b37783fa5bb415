# SPDX-License-Identifier: MIT
r"""A solved frame solved again: its hand's factors stay linearized while its pose moves little.

A late visual pose changes what was believed before a frame, or what is seen in it, but not what its pads say. So the
graph of a frame that is solved again is

    motion factor from what is believed before it now
    visual factor, where there is a visual pose now
    the hand's factors as they were linearized where the frame was solved:  g'd + 1/2 d'S d,    T_ho = T_ho* Exp(d)

and no pad is searched again. Farther from T_ho* than a threshold they are linearized anew, once, as in iSAM2 (Kaess
et al. 2012, fluid relinearization); where no pad was near the object there is nothing to linearize.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import gtsam

from .config import EstimatorConfig
from .covariance import LEVER
from .factors.visual import visual_factor
from .frame import Frame
from .graph import visual_noise
from .history import LinearizedHand, Past
from .knowledge import vision_information
from .memory import Belief, expectation, may_take_over, refused_since, with_vision
from .offsets import CalibrationPrior
from .optimize import optimize
from .solver import OBJECT
from .status import visual_weight

NEAR = 5e-4  # [m], a radian counted as ``LEVER``: so far from where they were linearized factors count as linear

# Linearizes a frame's hand at a pose.
Linearize = Callable[[Frame, gtsam.Pose3, CalibrationPrior], LinearizedHand]


def solved_again(
    past: Past,
    before: Belief | None,
    prior: CalibrationPrior,
    config: EstimatorConfig,
    linearize: Linearize,
) -> tuple[Past, float] | None:
    """The frame with what is believed before it now, and how much its visual pose counts.

    Args:
        past: The frame as it was solved, with the visual pose that it has now.
        before: What is believed before it now.
        prior: What is known of the robot's offsets.
        config: Settings.
        linearize: Linearizes its hand.

    Returns:
        None where the frame has to be solved anew: nothing was believed before, its hand is far from linear, or vision
        may take over.
    """
    frame, hand = past.frame, past.hand
    expected = expectation(before, frame, past.mode, config)
    if before is None or expected is None or hand is None:
        return None
    factors: list[gtsam.NonlinearFactor] = [expected.factor(OBJECT)]
    visual = None
    if frame.T_ho_visual is not None:
        noise = visual_noise(frame, config, prior, expected.images_alike)
        visual = visual_factor(OBJECT, frame.T_ho_visual, noise)
        factors.append(visual)
    values = _least(factors, hand, config)
    if not _near(hand, values):
        hand = linearize(frame, values.atPose3(OBJECT), prior)
        values = _least(factors, hand, config)
    weight = visual_weight(visual, values, config.visual_log_theta, expected.images_alike)
    refused = refused_since(before, frame, weight, config)
    if not _near(hand, values) or may_take_over(frame, refused, config):
        return None
    doubt = before.doubt if past.after is None else past.after.doubt
    says = hand.says.doubted(doubt.kappa, prior)
    if visual is not None:
        assert frame.T_wo_visual is not None
        says = says.plus(vision_information(visual, values, prior, frame.T_wo_visual))
    T_ho, knowledge = values.atPose3(OBJECT), expected.posterior(says)
    share = hand.says.offsets_share
    belief = Belief(frame.time, T_ho, knowledge, offsets_share=share, doubt=doubt)
    after = with_vision(belief, before, frame, weight, config)
    return past._replace(before=before, after=after, hand=hand), weight


def _least(
    factors: list[gtsam.NonlinearFactor], hand: LinearizedHand, config: EstimatorConfig
) -> gtsam.Values:
    """The least of some factors and the linearized hand's."""
    graph = gtsam.NonlinearFactorGraph()
    for factor in factors:
        graph.add(factor)
    if hand.says.information.any():
        graph.add(hand.factor(OBJECT))
    values = gtsam.Values()
    values.insert(OBJECT, pose3=hand.T_ho)
    return optimize(graph, values, config).values


def _near(hand: LinearizedHand, values: gtsam.Values) -> bool:
    """Whether the hand counts as linear from where it was linearized to here."""
    if not hand.says.information.any():
        return True
    step = gtsam.Pose3.Logmap(hand.T_ho.between(values.atPose3(OBJECT)))
    return math.hypot(*(step[:3] * LEVER), *step[3:]) < NEAR
