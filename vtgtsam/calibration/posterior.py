# SPDX-License-Identifier: MIT
"""From what was known of a robot to its calibration."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..config import EstimatorConfig
from ..hands.model import HandModel
from ..measurement import Measurement
from ..offsets import CalibrationPrior
from .calibration import Calibration
from .directions import unseen
from .keyframes import Grasp
from .robot import Robot
from .size import mean_over_sizes
from .solve import Belief


class Known(NamedTuple):
    """What is known of a robot before its grasps.

    Attributes:
        robot: Whose it is.
        camera_origin: The point that the camera's twist turns about, in the world [m], shape (3,).
        belief: Of the offsets.
        assumed: What is believed of any robot's offsets, a covariance (6 + J, 6 + J).
        made_from: Digests of the recordings that it comes from.
        afresh: Whether no more was known than of any robot, so that how far off this one is at all is open.
    """

    robot: Robot
    camera_origin: np.ndarray
    belief: Belief
    assumed: np.ndarray
    made_from: tuple[str, ...] = ()
    afresh: bool = False

    @classmethod
    def before(
        cls,
        robot: Robot,
        hand: HandModel,
        first: Measurement,
        prior: Calibration | None,
        config: EstimatorConfig,
    ) -> Known:
        """From an earlier calibration, or where there is none from what a configuration expects of a robot.

        Args:
            robot: The robot.
            hand: Its hand.
            first: A frame; the camera's twist turns about where the hand is in it.
            prior: The calibration.
            config: The configuration.
        """
        assumed = CalibrationPrior.of_config(config, hand.zero_units, np.zeros(3)).covariance
        if prior is not None:
            belief = Belief(prior.offsets, prior.covariance)
            return cls(robot, prior.camera_origin, belief, assumed, prior.made_from)
        origin = np.zeros(3) if first.T_wh is None else first.T_wh.translation()
        none = Belief(np.zeros(len(assumed)), assumed)
        return cls(robot, origin, none, assumed, afresh=True)


def calibration_of(
    belief: Belief, known: Known, grasps: Sequence[Grasp], made_from: Sequence[str] = ()
) -> Calibration:
    """The calibration that says what is believed of the offsets after some grasps.

    Args:
        belief: What that is.
        known: What was known before.
        grasps: The grasps, at least one.
        made_from: Digests of their recordings.
    """
    mean, covariance = belief
    if known.afresh:
        mean = mean_over_sizes(mean, covariance, known.assumed)
    touches = np.sum([frame.touching for each in grasps for frame in each.keyframes], axis=0)
    names = known.robot.joint_names
    return Calibration(
        robot=known.robot,
        camera=mean[:6],
        camera_origin=known.camera_origin,
        joint_zeros=dict(zip(names, mean[6:].tolist(), strict=True)),
        covariance=(covariance + covariance.T) / 2,
        unseen=unseen(covariance, known.assumed, grasps[0].hand, touches),
        made_from=(*known.made_from, *made_from),
    )
