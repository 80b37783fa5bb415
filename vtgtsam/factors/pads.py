# SPDX-License-Identifier: MIT
"""What the tactile and the penetration factor share: rows computed once per pose, however often GTSAM asks."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gtsam
import numpy as np

from ..sdf.closest import ClosestPoints, PadContacts
from .checked import checked_factor

PadResidual = Callable[[PadContacts], tuple[np.ndarray, np.ndarray]]


def pad_factor(
    key: int, closest: ClosestPoints, noise: gtsam.noiseModel.Base, residual: PadResidual
) -> gtsam.CustomFactor:
    """A factor on the object pose by the pads' closest points.

    Args:
        key: Key of the object pose T_wo.
        closest: Finds the pads' closest points, placed at the frame's pad poses.
        noise: Noise model of the residual's dimension, sigmas in [m].
        residual: Residual [m] and Jacobian, six columns, of the closest points.
    """
    seen: PadContacts | None = None
    rows = jacobian = np.empty(0)

    def error(
        factor: gtsam.CustomFactor, values: gtsam.Values, jacobians: list[Any] | None
    ) -> np.ndarray:
        nonlocal seen, rows, jacobian
        contacts = closest.at(values.atPose3(key))
        if contacts is not seen:
            rows, jacobian = residual(contacts)
            seen = contacts
        if jacobians is not None:
            jacobians[0] = jacobian
        return rows

    return checked_factor(noise, [key], error)
