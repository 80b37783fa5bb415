# SPDX-License-Identifier: MIT
r"""Clearance factor: a pad that reports no contact is not inside the object, wherever the joints' zeros are.

    r_k(T_ho, dq) = min(0, phi_k(T_ho, dq))    [m]    for each pad k that does not touch,

with phi_k of ``jointed_pads``: what ``penetration`` says of a frame whose joints are known, for the pads that
``offset_contacts`` leaves.
"""

from __future__ import annotations

import gtsam
import numpy as np

from .checked import POSE3_DIMENSION, checked_factor
from .jointed_pads import JointedPads
from .penetration import penetration_jacobian, penetration_residual


def clearance_factor(
    key: int, zeros_key: int, pads: JointedPads, noise: gtsam.noiseModel.Base
) -> gtsam.CustomFactor:
    """Keep the object out of the pads that report no contact.

    Args:
        key: Key of the object's pose T_ho.
        zeros_key: Key of the joints' zeros dq, a vector of dimension J.
        pads: The frame's pads.
        noise: Noise model whose dimension is the number of pads that do not touch, sigmas in [m].
    """
    (apart,) = (~pads.touching).nonzero()

    def error(
        factor: gtsam.CustomFactor, values: gtsam.Values, jacobians: list[np.ndarray] | None
    ) -> np.ndarray:
        T_ho, zeros = values.atPose3(key), values.atVector(zeros_key)
        contacts = pads.at(T_ho, zeros)
        distances = contacts.distances[apart]
        if jacobians is not None:
            jacobians[0] = penetration_jacobian(distances, contacts.jacobians[apart])
            jacobians[1] = penetration_jacobian(
                distances, pads.derivative_by_zeros(T_ho, zeros)[apart]
            )
        return penetration_residual(distances)

    return checked_factor(noise, [key, zeros_key], error, [POSE3_DIMENSION, pads.joints])
