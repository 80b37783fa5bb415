# SPDX-License-Identifier: MIT
"""From what the factors know of a pose to how sure it is, direction by direction."""

from __future__ import annotations

from typing import Any

import numpy as np

from .cholesky import factorize, invert
from .compiled import compiled

LEVER = 0.1  # [m], a radian is weighed as this many metres: the size of an object in a hand
# To information about metres in all six directions.
_SCALE = np.array([1 / LEVER] * 3 + [1.0] * 3)
_ROUNDING = 1e-9  # an eigenvalue this far below the largest is rounding
_NOTHING = 1e-12  # [1/m^2], less is no information: a standard deviation of 1000 km


@compiled
def all_held(information: Any, share: float) -> bool:
    """Whether in all six directions the information is at least ``share`` of that in the best one.

    Args:
        information: Information about a pose, (6, 6), rotation [1/rad^2] first, then translation [1/m^2].
        share: Smallest share of the largest eigenvalue, after scaling radians to metres with ``LEVER``.
    """
    scaled = np.empty((6, 6))
    least, most = np.inf, 0.0
    for i in range(6):
        for j in range(6):
            scaled[i, j] = _SCALE[i] * information[i, j] * _SCALE[j]
        least, most = min(least, scaled[i, i]), max(most, scaled[i, i])
    if least <= max(share * most, _NOTHING):  # eigenvalues reach at least as far as the diagonal
        return False
    eigenvalues = np.linalg.eigvalsh(scaled)
    return eigenvalues[0] > max(share * eigenvalues[-1], _NOTHING)  # type: ignore[no-any-return]


@compiled
def covariance_of(information: Any) -> Any:
    """Inverse of an information matrix (6, 6), infinite along the directions that nothing measures.

    An entry is infinite (with the sign of the growth) where an unmeasured direction involves both its row and
    its column; the other entries are those of the pseudo-inverse.
    """
    scaled, covariance = np.empty((6, 6)), np.empty((6, 6))
    for i in range(6):
        for j in range(6):
            scaled[i, j] = _SCALE[i] * information[i, j] * _SCALE[j]
    if not _inverse(scaled, covariance):
        _pseudo_inverse(scaled, covariance)
    for i in range(6):
        for j in range(6):
            covariance[i, j] *= _SCALE[i] * _SCALE[j]
    return covariance


@compiled
def _inverse(A: Any, inverse: Any) -> bool:
    """Inverse of a symmetric matrix (6, 6), and whether all directions are known by it.

    The least eigenvalue is at least 1 / |A^-1| and the largest at most the trace, so that no eigenvalue needs to be
    computed where all are large enough.
    """
    L, M = np.empty((6, 6)), np.zeros((6, 6))
    if not factorize(A, 0.0, L):
        return False
    invert(L, M)
    squared, trace = 0.0, 0.0
    for i in range(6):
        trace += A[i, i]
        for j in range(6):
            inverse[i, j] = 0.0
            for k in range(6):
                inverse[i, j] += M[k, i] * M[k, j]
            squared += inverse[i, j] * inverse[i, j]
    return 1.0 / np.sqrt(squared) > max(_ROUNDING * trace, _NOTHING)  # type: ignore[no-any-return]


@compiled
def _pseudo_inverse(A: Any, inverse: Any) -> None:
    """Inverse of a symmetric matrix (6, 6) along the eigenvectors whose eigenvalues are no rounding, infinite else."""
    eigenvalues, vectors = np.linalg.eigh(A)
    least = max(_ROUNDING * eigenvalues[-1], _NOTHING)
    unknown = np.zeros((6, 6))
    for i in range(6):
        for j in range(6):
            inverse[i, j] = 0.0
            for n in range(6):
                outer = vectors[i, n] * vectors[j, n]
                if eigenvalues[n] > least:
                    inverse[i, j] += outer / eigenvalues[n]
                else:
                    unknown[i, j] += outer
    for i in range(6):
        for j in range(6):
            size = np.sqrt(unknown[i, i] * unknown[j, j])
            if abs(unknown[i, j]) > _ROUNDING * max(size, 1.0):
                inverse[i, j] = np.copysign(np.inf, unknown[i, j])
