# SPDX-License-Identifier: MIT
"""What touches of a hand with itself say of its joints' zeros, beside its grasps."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import gtsam
import numpy as np

from ..factors.noise import welsch_of_norm
from ..factors.pad_touch import touch_factor
from ..hands.model import HandModel
from .graph import ZEROS

STAND_OFF = 0.0004  # [m], between the flat parts of pads that touch: mostly their round rims do
SIGMA = 0.0004  # [m], of that
LOG_THETA = 3.0  # log of the Welsch loss's theta: 4.5 sigmas


class Felt(NamedTuple):
    """Two pads that touched each other.

    Attributes:
        joints: Joint angles as measured [rad], shape (J,).
        a: Index of one pad.
        b: Index of the other one.
    """

    joints: np.ndarray
    a: int
    b: int


def add_touches(
    graph: gtsam.NonlinearFactorGraph, hand: HandModel, touches: Sequence[Felt]
) -> None:
    """Put a factor for each touch into a graph with the joints' zeros."""
    noise = welsch_of_norm(gtsam.noiseModel.Isotropic.Sigma(1, SIGMA), LOG_THETA)
    for touch in touches:
        graph.push_back(touch_factor(ZEROS, hand, touch.joints, touch.a, touch.b, STAND_OFF, noise))
