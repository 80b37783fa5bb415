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

from ..sdf.closest import ClosestPoints, PadContacts
from .checked import checked_factor


def penetration_residual(contacts: PadContacts) -> tuple[np.ndarray, np.ndarray]:
    """Depths of all pads inside the object [m], negative, shape (K,), and their Jacobian, shape (K, 6)."""
    inside = contacts.distances < 0
    return np.minimum(0.0, contacts.distances), contacts.jacobians * inside[:, None]


def penetration_factor(
    key: int, closest: ClosestPoints, noise: gtsam.noiseModel.Base
) -> gtsam.CustomFactor:
    """Push the object out of the hand's pads.

    Args:
        key: Key of the object pose T_wo.
        closest: Finds the pads' closest points, placed at this frame's pad poses.
        noise: Noise model of dimension K, sigmas in [m].
    """

    def error(
        factor: gtsam.CustomFactor, values: gtsam.Values, jacobians: list[Any] | None
    ) -> np.ndarray:
        residual, jacobian = penetration_residual(closest.at(values.atPose3(key)))
        if jacobians is not None:
            jacobians[0] = jacobian
        return residual

    return checked_factor(noise, [key], error)
