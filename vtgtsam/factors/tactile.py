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

from ..sdf.closest import ClosestPoints, PadContacts
from .checked import checked_factor


def tactile_residual(contacts: PadContacts, touching: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Gaps of the touching pads [m], shape (N,), and their Jacobian, shape (N, 6).

    Args:
        contacts: The pads' closest points at the pose in question.
        touching: Indices of the pads that report contact, shape (N,).
    """
    distances = contacts.distances[touching]
    outside = distances > 0
    return np.maximum(0.0, distances), contacts.jacobians[touching] * outside[:, None]


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
        residual, jacobian = tactile_residual(closest.at(values.atPose3(key)), touching)
        if jacobians is not None:
            jacobians[0] = jacobian
        return residual

    return checked_factor(noise, [key], error)
