# SPDX-License-Identifier: MIT
r"""A solved frame solved again: its hand's factors stay linearized while its pose moves little.

A late visual pose changes what was believed before a frame, or what is seen in it, but not what its pads say. So the
graph of a frame that is solved again is

    motion factor from what is believed before it now
    visual factor, where there is a visual pose now
    the hand's factors as they were linearized where the frame was solved:  g'd + 1/2 d'S d,    T_ho = T_ho* Exp(d)

and no pad is searched again. Farther from T_ho* than a threshold the frame has to be solved anew, as in iSAM2 (Kaess
et al. 2012, fluid relinearization).
"""

from __future__ import annotations

import math

import gtsam
from gtsam.symbol_shorthand import X

from .config import EstimatorConfig
from .covariance import LEVER
from .factors.visual import visual_factor
from .graph import visual_noise
from .history import Past
from .knowledge import vision_information
from .memory import Belief, expectation, may_take_over, refused_since
from .offsets import CalibrationPrior
from .optimize import optimize
from .status import visual_weight

NEAR = 1e-3  # [m], a radian counted as ``LEVER``: so far from where they were linearized factors count as linear
OBJECT = X(0)  # key of T_ho


def solved_again(
    past: Past, before: Belief | None, prior: CalibrationPrior, config: EstimatorConfig
) -> tuple[Past, float] | None:
    """The frame with what is believed before it now, and how much its visual pose counts.

    Args:
        past: The frame as it was solved, with the visual pose that it has now.
        before: What is believed before it now.
        prior: What is known of the robot's offsets.
        config: Settings.

    Returns:
        None where the frame has to be solved anew: it is far from where it was, or vision may take over.
    """
    frame, hand = past.frame, past.hand
    expected = expectation(before, frame.time, past.mode, config)
    if expected is None or hand is None:
        return None
    graph = gtsam.NonlinearFactorGraph()
    graph.add(expected.factor(OBJECT))
    graph.add(hand.factor(OBJECT))
    visual = None
    if frame.T_ho_visual is not None:
        visual = visual_factor(OBJECT, frame.T_ho_visual, visual_noise(frame, config, prior))
        graph.add(visual)
    values = gtsam.Values()
    values.insert(OBJECT, pose3=hand.T_ho)
    values = optimize(graph, values, config).values
    weight = visual_weight(visual, values, config.visual_log_theta)
    refused = refused_since(before, frame, weight, config)
    T_ho = values.atPose3(OBJECT)
    if _far(hand.T_ho, T_ho) or may_take_over(frame, refused, config):
        return None
    says = hand.says
    if visual is not None:
        assert frame.T_wo_visual is not None
        says = says.plus(vision_information(visual, values, prior, frame.T_wo_visual))
    after = Belief(frame.time, T_ho, expected.posterior(says), refused)
    return past._replace(before=before, after=after), weight


def _far(T_ho: gtsam.Pose3, other: gtsam.Pose3) -> bool:
    step = gtsam.Pose3.Logmap(T_ho.between(other))
    return not math.hypot(*(step[:3] * LEVER), *step[3:]) < NEAR
