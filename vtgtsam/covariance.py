# SPDX-License-Identifier: MIT
"""From what the factors know of a pose to how sure it is, direction by direction."""

from __future__ import annotations

import numpy as np

LEVER = 0.1  # [m], a radian is weighed as this many metres: the size of an object in a hand
_UNIT = np.diag([1 / LEVER] * 3 + [1.0] * 3)  # to information about metres in all six directions
_ROUNDING = 1e-9  # an eigenvalue this far below the largest is rounding
_NOTHING = 1e-12  # [1/m^2], less is no information: a standard deviation of 1000 km


def held_directions(information: np.ndarray, share: float) -> int:
    """In how many of the six directions the information is at least ``share`` of that in the best one.

    Args:
        information: Information about a pose, (6, 6), rotation [1/rad^2] first, then translation [1/m^2].
        share: Smallest share of the largest eigenvalue, after scaling radians to metres with ``LEVER``.
    """
    eigenvalues = np.linalg.eigvalsh(_UNIT @ information @ _UNIT)
    return int((eigenvalues > max(share * eigenvalues[-1], _NOTHING)).sum())


def covariance_of(information: np.ndarray) -> np.ndarray:
    """Inverse of an information matrix (6, 6), infinite along the directions that nothing measures.

    An entry is infinite (with the sign of the growth) where an unmeasured direction involves both its row and
    its column; the other entries are those of the pseudo-inverse.
    """
    eigenvalues, vectors = np.linalg.eigh(_UNIT @ information @ _UNIT)
    known = eigenvalues > max(_ROUNDING * eigenvalues[-1], _NOTHING)
    axes = _UNIT @ vectors
    covariance = (axes[:, known] / eigenvalues[known]) @ axes[:, known].T
    unknown = axes[:, ~known] @ axes[:, ~known].T
    scale = np.sqrt(np.outer(np.diag(unknown), np.diag(unknown)))
    unbounded = np.abs(unknown) > 1e-9 * np.maximum(scale, 1.0)
    return np.where(unbounded, np.copysign(np.inf, unknown), covariance)
