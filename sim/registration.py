# SPDX-License-Identifier: MIT
"""What a registration gets wrong: the pose at which a tracker is told to begin."""

from __future__ import annotations

import gtsam
import numpy as np

from .calibration import random_direction

TRANSLATION = 0.005  # [m]
ROTATION = np.deg2rad(5.0)  # [rad]


def drawn_registration(center_o: np.ndarray, rng: np.random.Generator) -> gtsam.Pose3:
    """An error of 5 mm and 5 degrees about the object's centre, each in a random direction.

    It is to be multiplied from the right, T_wo registered = T_wo T: the object's centre (3,) [m] moves by 5 mm.
    """
    center = gtsam.Pose3(gtsam.Rot3(), center_o)
    rotation = gtsam.Rot3.Expmap(ROTATION * random_direction(rng))
    return center * gtsam.Pose3(rotation, TRANSLATION * random_direction(rng)) * center.inverse()
