# SPDX-License-Identifier: MIT
r"""Tactile factor: a pad that reports contact touches the object's surface (paper, eq. 1).

With p_k the pad's grid point that is closest to the object at the pose in question, and phi the signed distance,

    r_k(T_ho) = max(0, phi(T_ho^-1 p_k))    [m]    for each pad k in contact,

so a gap pulls the surface onto the pad, and a penetration is left to the penetration factor. The Jacobian is that of
phi for a right perturbation of T_ho, [ (grad phi x p_o)^T  -grad phi^T ] with p_o = T_ho^-1 p_k, where the residual is
positive, and zero elsewhere.

One factor holds all touching pads of a frame: one call from GTSAM instead of one a pad. Its robust noise model gives
each row a Welsch loss of its own, so an outlier silences itself only.
"""

from __future__ import annotations

import gtsam
import numpy as np

from ..compiled import compiled_in_place
from .checked import checked_factor
from .pad_distances import JointZeros, PadDistances


def tactile_residual(distances: np.ndarray) -> np.ndarray:
    """Gaps of touching pads [m], shape (N,), from the signed distances of their closest points [m], shape (N,)."""
    residual: np.ndarray = np.maximum(distances, 0.0)
    return residual


def tactile_jacobian(distances: np.ndarray, jacobians: np.ndarray) -> np.ndarray:
    """Derivative of ``tactile_residual``, shape (N, 6), from the distances (N,) and their derivatives (N, 6)."""
    jacobian = np.zeros(jacobians.shape)
    _copy_rows_of_gaps(distances, jacobians, jacobian)
    return jacobian


@compiled_in_place
def _copy_rows_of_gaps(distances: np.ndarray, source: np.ndarray, target: np.ndarray) -> None:
    for k in range(len(distances)):
        if distances[k] > 0.0:
            for i in range(source.shape[1]):
                target[k, i] = source[k, i]


def tactile_factor(
    key: int, pads: PadDistances, noise: gtsam.noiseModel.Base, zeros: JointZeros | None = None
) -> gtsam.CustomFactor:
    """Pull the object's surface onto the pads that report contact.

    Args:
        key: Key of the object's pose T_ho.
        pads: The frame's pads.
        noise: Noise model whose dimension is the number of touching pads, sigmas in [m].
        zeros: The joints' zeros where they are uncertain, the factor's second unknown.
    """
    (touching,) = pads.touching.nonzero()
    if zeros is None:

        def error(
            factor: gtsam.CustomFactor, values: gtsam.Values, jacobians: list[np.ndarray] | None
        ) -> np.ndarray:
            contacts = pads.at(values.atPose3(key))
            distances = contacts.distances.take(touching)
            if jacobians is not None:
                of_pose = contacts.jacobians.take(touching, axis=0)
                jacobians[0] = tactile_jacobian(distances, of_pose)
            return tactile_residual(distances)

        return checked_factor(noise, [key], error)

    zeros_key, G = zeros.key, zeros.jacobian[touching]

    def error_with_zeros(
        factor: gtsam.CustomFactor, values: gtsam.Values, jacobians: list[np.ndarray] | None
    ) -> np.ndarray:
        contacts = pads.at(values.atPose3(key))
        distances = contacts.distances.take(touching) + G @ values.atVector(zeros_key)
        if jacobians is not None:
            of_pose = contacts.jacobians.take(touching, axis=0)
            jacobians[0] = tactile_jacobian(distances, of_pose)
            jacobians[1] = tactile_jacobian(distances, G)
        return tactile_residual(distances)

    return checked_factor(noise, [key, zeros_key], error_with_zeros, [6, G.shape[1]])
