# SPDX-License-Identifier: MIT
r"""Visual factor: the pose that a visual tracker reports (paper, section III-B).

The residual is the twist between the estimate and the reported pose, both seen from the hand,

    r(T_ho) = Log(T_ho_visual^-1 T_ho),    rotation [rad] first, then translation [m],

which is GTSAM's own ``PriorFactorPose3``. (The paper writes Log(T_ho^-1 T_ho_visual), which is -r: the same objective.)
One Welsch loss on the weighted norm of all six lets go of a visual pose that the hand contradicts.
"""

from __future__ import annotations

import gtsam


def visual_factor(
    key: int, T_ho_visual: gtsam.Pose3, noise: gtsam.noiseModel.Base
) -> gtsam.PriorFactorPose3:
    """Hold the object at the pose that the tracker reports.

    Args:
        key: Key of the object's pose T_ho.
        T_ho_visual: The reported pose, in the hand.
        noise: Noise model of dimension 6, rotation [rad] first, then translation [m].
    """
    return gtsam.PriorFactorPose3(key, T_ho_visual, noise)
