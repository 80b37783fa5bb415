# SPDX-License-Identifier: MIT
r"""Motion factor: where the frames before say the object is in the hand, widened by how it may have moved since.

The residual is the twist from the last estimate to this one, both in the hand,

    r(T_ho) = Log(T_ho(t-1)^-1 T_ho),    rotation [rad] first, then translation [m],

with the information (M(t-1)^-1 + Q)^-1: what was known a frame ago, and the random walk of the present mode on top
(``modes``). The last pose itself is not estimated again (a window of one frame), so this is a ``PriorFactorPose3``.
Directions that nothing has measured yet have no information.
"""

from __future__ import annotations

import gtsam
import numpy as np


def motion_factor(
    key: int, T_ho_before: gtsam.Pose3, information: np.ndarray
) -> gtsam.PriorFactorPose3:
    """Hold the object where the frames before say it is.

    Args:
        key: Key of the object's pose T_ho.
        T_ho_before: The last estimate.
        information: About that pose now, symmetric, shape (6, 6), rotation [1/rad^2] first; may be singular.
    """
    eigenvalues, vectors = np.linalg.eigh(information)
    R = np.sqrt(np.maximum(eigenvalues, 0.0))[:, None] * vectors.T
    noise = gtsam.noiseModel.Gaussian.SqrtInformation(R, False)  # else GTSAM looks for sigmas in it
    return gtsam.PriorFactorPose3(key, T_ho_before, noise)


def widened(information: np.ndarray, spread: np.ndarray) -> np.ndarray:
    """Information (M^-1 + Q)^-1, shape (6, 6), of a pose that has moved by Q (6, 6), positive definite, since.

    As M - M (M + Q^-1)^-1 M, which is right where M is singular too.
    """
    gain = np.linalg.solve(information + np.linalg.inv(spread), information)
    moved = information - information @ gain
    return (moved + moved.T) / 2  # type: ignore[no-any-return]
