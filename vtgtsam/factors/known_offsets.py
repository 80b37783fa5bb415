# SPDX-License-Identifier: MIT
r"""Prior of a robot's offsets: the camera's twist e and the joints' zeros dq, correlations between them included.

    r(e, dq) = (e, dq) - (e, dq)_0,

whitened by one covariance of all 6 + J. A ``PriorFactorVector`` each could not hold what an earlier calibration knows
of both together.
"""

from __future__ import annotations

import gtsam
import numpy as np

from .checked import POSE3_DIMENSION, checked_factor


def known_offsets_factor(
    camera_key: int, zeros_key: int, mean: np.ndarray, covariance: np.ndarray
) -> gtsam.CustomFactor:
    """Hold the offsets where they are known to be.

    Args:
        camera_key: Key of the camera's twist e, a vector of dimension 6.
        zeros_key: Key of the joints' zeros dq, a vector of dimension J.
        mean: What is believed of both, shape (6 + J,).
        covariance: How sure that is, shape (6 + J, 6 + J).
    """
    of_camera, of_zeros = np.split(np.eye(len(mean)), [POSE3_DIMENSION], axis=1)

    def error(
        factor: gtsam.CustomFactor, values: gtsam.Values, jacobians: list[np.ndarray] | None
    ) -> np.ndarray:
        if jacobians is not None:
            jacobians[0], jacobians[1] = of_camera, of_zeros
        offsets = [values.atVector(camera_key), values.atVector(zeros_key)]
        residual: np.ndarray = np.concatenate(offsets) - mean
        return residual

    noise = gtsam.noiseModel.Gaussian.Covariance(covariance)
    return checked_factor(
        noise, [camera_key, zeros_key], error, [POSE3_DIMENSION, len(mean) - POSE3_DIMENSION]
    )
