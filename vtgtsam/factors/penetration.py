# SPDX-License-Identifier: MIT
r"""Penetration factor: object and hand do not interpenetrate (paper, eq. 2).

With p_k the pad's grid point of least signed distance at the pose in question,

    r_k(T_wo) = min(0, phi(T_wo^-1 p_k))    [m]    for every pad k, touching or not,

which pushes the object out of the pad. The Jacobian is that of phi, [ (grad phi x p_o)^T  -grad phi^T ], where
the residual is negative, and zero elsewhere. Not robust: geometry has no outliers.
"""

from __future__ import annotations

from typing import Any

import gtsam
import numpy as np

from ..compiled import compiled
from ..sdf.closest import ClosestPoints
from .pads import pad_factor


@compiled
def penetration_residual(distances: Any, jacobians: Any) -> Any:
    """Depths of all pads inside the object [m], negative, shape (K,), and their Jacobian, shape (K, 6).

    Args:
        distances: Signed distances of all pads' closest points at the pose in question [m], shape (K,).
        jacobians: Their derivatives, shape (K, 6).
    """
    residual = np.zeros(len(distances))
    jacobian = np.zeros((len(distances), 6))
    for k in range(len(distances)):
        if distances[k] < 0:
            residual[k] = distances[k]
            jacobian[k] = jacobians[k]
    return residual, jacobian


def penetration_factor(
    key: int, closest: ClosestPoints, noise: gtsam.noiseModel.Base
) -> gtsam.CustomFactor:
    """Push the object out of the hand's pads.

    Args:
        key: Key of the object pose T_wo.
        closest: Finds the pads' closest points, placed at the frame's pad poses.
        noise: Noise model of dimension K, sigmas in [m].
    """
    return pad_factor(
        key, closest, noise, lambda pads: penetration_residual(pads.distances, pads.jacobians)
    )
