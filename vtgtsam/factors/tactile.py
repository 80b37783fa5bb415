# SPDX-License-Identifier: MIT
r"""Tactile factor: a pad that reports contact touches the object's surface (paper, eq. 1).

With p_k the pad's grid point of least signed distance at the pose in question,

    r_k(T_wo) = max(0, phi(T_wo^-1 p_k))    [m]    for each pad k in contact,

so a gap pulls the surface onto the pad, and a penetration is left to the penetration factor. The Jacobian is
that of phi, [ (grad phi x p_o)^T  -grad phi^T ], where the residual is positive, and zero elsewhere.

One factor holds all touching pads of a frame: one call from GTSAM instead of up to K.
"""

from __future__ import annotations

from typing import Any

import gtsam
import numpy as np

from ..compiled import compiled
from ..sdf.closest import ClosestPoints
from .checked import checked_factor


@compiled
def tactile_residual(distances: Any, jacobians: Any, touching: Any) -> Any:
    """Gaps of the touching pads [m], shape (N,), and their Jacobian, shape (N, 6).

    Args:
        distances: Signed distances of all pads' closest points at the pose in question [m], shape (K,).
        jacobians: Their derivatives, shape (K, 6).
        touching: Indices of the pads that report contact, shape (N,).
    """
    residual = np.zeros(len(touching))
    jacobian = np.zeros((len(touching), 6))
    for n, k in enumerate(touching):
        if distances[k] > 0:
            residual[n] = distances[k]
            jacobian[n] = jacobians[k]
    return residual, jacobian


def tactile_factor(
    key: int, touching: np.ndarray, closest: ClosestPoints, noise: gtsam.noiseModel.Base
) -> gtsam.CustomFactor:
    """Pull the object's surface onto the pads that report contact.

    Args:
        key: Key of the object pose T_wo.
        touching: Indices of the pads that report contact, shape (N,).
        closest: Finds the pads' closest points, placed at this frame's pad poses.
        noise: Noise model of dimension N, sigmas in [m].
    """

    def error(
        factor: gtsam.CustomFactor, values: gtsam.Values, jacobians: list[Any] | None
    ) -> np.ndarray:
        contacts = closest.at(values.atPose3(key))
        residual, jacobian = tactile_residual(contacts.distances, contacts.jacobians, touching)
        if jacobians is not None:
            jacobians[0] = jacobian
        return residual  # type: ignore[no-any-return]

    return checked_factor(noise, [key], error)
