# SPDX-License-Identifier: MIT
r"""Visual factor: the pose a visual tracker reports (paper, section III-B).

The residual is the twist from the estimate to the reported pose,

    r(T_wo) = log(T_wo^-1 T_wo_visual),    rotation [rad] first, then translation [m].

GTSAM's own ``PriorFactorPose3`` has minus that twist, which is the same objective, with an exact Jacobian.
One Welsch loss on the weighted norm of all six lets go of a visual pose that the hand contradicts.
"""

from __future__ import annotations

import gtsam
import numpy as np


def visual_residual(T_wo: gtsam.Pose3, T_wo_visual: gtsam.Pose3) -> np.ndarray:
    """Twist from the estimate to the visual pose, shape (6,), rotation [rad] first, then translation [m]."""
    return gtsam.Pose3.Logmap(T_wo.between(T_wo_visual))


def visual_factor(
    key: int, T_wo_visual: gtsam.Pose3, noise: gtsam.noiseModel.Base
) -> gtsam.PriorFactorPose3:
    """Hold the object pose at the visual tracker's.

    Args:
        key: Key of the object pose T_wo.
        T_wo_visual: Pose the tracker reports.
        noise: Noise model of dimension 6, rotation first.
    """
    return gtsam.PriorFactorPose3(key, T_wo_visual, noise)
