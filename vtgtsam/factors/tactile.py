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
from .pads import pad_factor


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


@compiled
def tactile_weights(distances: Any, touching: Any, weight: float, log_theta: float) -> Any:
    """How much each pad's contact counts after its Welsch loss, exp(-w r^2 / theta), 0 without contact, (K,)."""
    weights = np.zeros(len(distances))
    for k in range(len(distances)):
        if touching[k]:
            gap = max(0.0, distances[k])
            weights[k] = np.exp(-weight * gap * gap / np.exp(log_theta))
    return weights


def tactile_factor(
    key: int, touching: np.ndarray, closest: ClosestPoints, noise: gtsam.noiseModel.Base
) -> gtsam.CustomFactor:
    """Pull the object's surface onto the pads that report contact.

    Args:
        key: Key of the object pose T_wo.
        touching: Indices of the pads that report contact, shape (N,).
        closest: Finds the pads' closest points, placed at the frame's pad poses.
        noise: Noise model of dimension N, sigmas in [m].
    """
    return pad_factor(
        key, closest, noise, lambda pads: tactile_residual(pads.distances, pads.jacobians, touching)
    )
