# SPDX-License-Identifier: MIT
r"""Penetration factor: object and hand do not interpenetrate (paper, eq. 2).

With p_k the pad's grid point that is closest to the object at the pose in question, and phi the signed distance,

    r_k(T_ho) = min(0, phi(T_ho^-1 p_k))    [m]    for every pad k, touching or not,

which pushes the object out of the pad. The Jacobian is that of phi for a right perturbation of T_ho,
[ (grad phi x p_o)^T  -grad phi^T ] with p_o = T_ho^-1 p_k, where the residual is negative, and zero elsewhere.
Not robust: geometry has no outliers.
"""

from __future__ import annotations

import gtsam
import numpy as np

from ..compiled import compiled_in_place
from .checked import checked_factor
from .pad_distances import JointZeros, PadDistances


def penetration_residual(distances: np.ndarray) -> np.ndarray:
    """Depths of pads in the object [m], negative, shape (K,), from their closest points' distances [m], shape (K,)."""
    residual: np.ndarray = np.minimum(distances, 0.0)
    return residual


def penetration_jacobian(distances: np.ndarray, jacobians: np.ndarray) -> np.ndarray:
    """Derivative of ``penetration_residual``, shape (K, 6), from distances (K,) and their derivatives (K, 6)."""
    jacobian = np.zeros(jacobians.shape)
    _copy_rows_inside(distances, jacobians, jacobian)
    return jacobian


@compiled_in_place
def _copy_rows_inside(distances: np.ndarray, source: np.ndarray, target: np.ndarray) -> None:
    for k in range(len(distances)):
        if distances[k] < 0.0:
            for i in range(source.shape[1]):
                target[k, i] = source[k, i]


def penetration_factor(
    key: int, pads: PadDistances, noise: gtsam.noiseModel.Base, zeros: JointZeros | None = None
) -> gtsam.CustomFactor:
    """Push the object out of the hand's pads.

    Args:
        key: Key of the object's pose T_ho.
        pads: The frame's pads.
        noise: Noise model whose dimension is the number of pads, sigmas in [m].
        zeros: The joints' zeros where they are uncertain, the factor's second unknown.
    """
    if zeros is None:

        def error(
            factor: gtsam.CustomFactor, values: gtsam.Values, jacobians: list[np.ndarray] | None
        ) -> np.ndarray:
            contacts = pads.at(values.atPose3(key))
            if jacobians is not None:
                jacobians[0] = penetration_jacobian(contacts.distances, contacts.jacobians)
            return penetration_residual(contacts.distances)

        return checked_factor(noise, [key], error)

    zeros_key, G = zeros

    def error_with_zeros(
        factor: gtsam.CustomFactor, values: gtsam.Values, jacobians: list[np.ndarray] | None
    ) -> np.ndarray:
        contacts = pads.at(values.atPose3(key))
        distances = contacts.distances + G @ values.atVector(zeros_key)
        if jacobians is not None:
            jacobians[0] = penetration_jacobian(distances, contacts.jacobians)
            jacobians[1] = penetration_jacobian(distances, G)
        return penetration_residual(distances)

    return checked_factor(noise, [key, zeros_key], error_with_zeros, [6, G.shape[1]])
