# SPDX-License-Identifier: MIT
r"""How far off a robot is at all: what grasps say of an exact one is noise, and is not to be corrected.

A camera, and a hand's joints, are mostly off as far as is assumed of any, some a third or a tenth of that: nine sizes
D = diag(s_camera I, s_joints I). Grasps with the information H and the pull b, seen from no offset, have

    L(D) = |I + D P0 D H|^(-1/2) exp(b' c_D / 2),    c_D = (H + (D P0 D)^-1)^-1 b

as the likelihood of each, and the offsets' mean is the c_D's. Their covariance stays that of the largest size, so that
an offset that no grasp has seen is not said to be known.
"""

from __future__ import annotations

from itertools import product

import numpy as np

from ..offsets import CAMERA

# Of the standard deviations assumed of any robot, and how often: robots that are off as assumed lose nothing by the
# others (0.61 mm of error left with and without), which are left with 0.1 to 0.4 mm instead of 0.45.
SHARES = {1.0: 10.0, 0.3: 1.0, 0.1: 1.0}


def mean_over_sizes(mean: np.ndarray, covariance: np.ndarray, assumed: np.ndarray) -> np.ndarray:
    """The offsets to correct, shape (6 + J,): those believed, shrunk where the robot is less far off than assumed.

    Args:
        mean: What is believed of the offsets, where before all grasps it was none, shape (6 + J,).
        covariance: Of these, shape (6 + J, 6 + J).
        assumed: What is believed of any robot's offsets, a covariance of that shape.
    """
    precision = np.linalg.inv(covariance)
    information, pull = precision - np.linalg.inv(assumed), precision @ mean
    joints = len(mean) - CAMERA
    logs, means = [], []
    for shares in product(SHARES, SHARES):
        often = SHARES[shares[0]] * SHARES[shares[1]]
        size = np.repeat(shares, [CAMERA, joints])
        of_this = size[:, None] * assumed * size
        spread = np.eye(len(mean)) + of_this @ information
        means.append(np.linalg.solve(spread, of_this @ pull))
        logs.append(np.log(often) + (pull @ means[-1] - np.linalg.slogdet(spread)[1]) / 2)
    averaged: np.ndarray = np.average(means, axis=0, weights=np.exp(np.array(logs) - max(logs)))
    return averaged
