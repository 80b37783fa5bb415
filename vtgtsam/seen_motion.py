# SPDX-License-Identifier: MIT
r"""What two images show of the object's motion in the hand between them.

A camera that is not where the robot believes, and a tracker that has settled beside the object, are off alike in both
images, which cancels in their difference. So the visual poses tell more of the motion since the last image,

    d = Log(T_ho_visual(t-1)^-1 T_ho_visual(t)),    rotation [rad] first, then translation [m],

than of where the object is. D = 8 R is how unsure d is: both poses' own covariance R, without the camera's share, as if
their errors were independent, and with twice their sigmas, since a tracker lags and jumps where fingers come. With the
random walk Q of the present mode since the image before, the motion is expected to be K d, and of what the walk has
unsure I - K is left:

    K = Q (Q + D / w)^-1

A difference that neither explains, a flip or a jump, counts less by Welsch's weight w = exp(-d' (Q + D)^-1 d / theta),
with theta as for the visual pose itself. Where frames without an image came between, d is what they have not moved yet.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import gtsam
import numpy as np

from .config import EstimatorConfig
from .frame import Frame
from .graph import tracker_covariance

ERRORS = 2.0 * 2.0**2  # D / R
NOTHING = 1e-3  # below this weight a difference says nothing


class Seen(NamedTuple):
    """The last image whose visual pose was believed.

    Attributes:
        T_ho_visual: The visual pose.
        T_ho: The estimate in its frame.
    """

    T_ho_visual: gtsam.Pose3
    T_ho: gtsam.Pose3


def seen_motion(
    seen: Seen, T_ho: gtsam.Pose3, frame: Frame, walk: np.ndarray, config: EstimatorConfig
) -> tuple[np.ndarray, np.ndarray]:
    """The motion K d, shape (6,), and I - K, shape (6, 6).

    Args:
        seen: The image before.
        T_ho: The estimate in the frame before.
        frame: The frame now, with its visual pose.
        walk: Q, since the image before, shape (6, 6).
        config: Settings.
    """
    assert frame.T_ho_visual is not None
    moved = gtsam.Pose3.Logmap(seen.T_ho_visual.between(frame.T_ho_visual))
    moved = moved - gtsam.Pose3.Logmap(seen.T_ho.between(T_ho))
    errors = ERRORS * tracker_covariance(frame, config)
    squared = float(moved @ np.linalg.solve(walk + errors, moved))
    weight = math.exp(-squared / math.exp(config.visual_log_theta))
    if weight < NOTHING:
        return np.zeros(6), np.eye(6)
    errors = errors / weight
    share = np.linalg.inv(walk + errors)
    return walk @ share @ moved, errors @ share  # I - K = D (Q + D)^-1, without cancellation
