# SPDX-License-Identifier: MIT
"""From what the factors know of a pose to how sure it is, direction by direction."""

from __future__ import annotations

from typing import Any

import numpy as np

from .compiled import compiled

LEVER = 0.1  # [m], a radian is weighed as this many metres: the size of an object in a hand
_UNIT = np.array(
    [[1 / LEVER]] * 3 + [[1.0]] * 3
)  # to information about metres in all six directions
_ROUNDING = 1e-9  # an eigenvalue this far below the largest is rounding
_NOTHING = 1e-12  # [1/m^2], less is no information: a standard deviation of 1000 km


def held_directions(information: np.ndarray, share: float) -> int:
    """In how many of the six directions the information is at least ``share`` of that in the best one.

    Args:
        information: Information about a pose, (6, 6), rotation [1/rad^2] first, then translation [1/m^2].
        share: Smallest share of the largest eigenvalue, after scaling radians to metres with ``LEVER``.
    """
    eigenvalues = np.linalg.eigvalsh(_UNIT * information * _UNIT.T)
    return int((eigenvalues > max(share * eigenvalues[-1], _NOTHING)).sum())


@compiled
def covariance_of(information: Any) -> Any:
    """Inverse of an information matrix (6, 6), infinite along the directions that nothing measures.

    An entry is infinite (with the sign of the growth) where an unmeasured direction involves both its row and
    its column; the other entries are those of the pseudo-inverse.
    """
    known, covariance = _inverse(_UNIT * information * _UNIT.T)
    if known:
        return _UNIT * covariance * _UNIT.T
    eigenvalues, vectors = np.linalg.eigh(_UNIT * information * _UNIT.T)
    least = max(_ROUNDING * eigenvalues[-1], _NOTHING)
    covariance, unknown = np.zeros((6, 6)), np.zeros((6, 6))
    for n in range(6):
        axis = _UNIT[:, 0] * vectors[:, n]
        outer = axis.reshape(6, 1) * axis
        if eigenvalues[n] > least:
            covariance += outer / eigenvalues[n]
        else:
            unknown += outer
    for i in range(6):
        for j in range(6):
            size = np.sqrt(unknown[i, i] * unknown[j, j])
            if np.abs(unknown[i, j]) > _ROUNDING * max(size, 1.0):
                covariance[i, j] = np.copysign(np.inf, unknown[i, j])
    return covariance


@compiled
def _inverse(A: Any) -> Any:
    """Inverse of a symmetric matrix by Cholesky's decomposition, and whether all directions are known by it.

    The least eigenvalue is at least 1 / |A^-1| and the largest at most the trace, so that no eigenvalue needs to be
    computed where all are large enough.
    """
    size = len(A)
    L, inverse = np.zeros((size, size)), np.zeros((size, size))  # A = L L', its inverse L'^-1 L^-1
    for i in range(size):
        for j in range(i + 1):
            rest = A[i, j] - (L[i, :j] * L[j, :j]).sum()
            if i != j:
                L[i, j] = rest / L[j, j]
            elif rest > 0:
                L[i, i] = np.sqrt(rest)
            else:
                return False, inverse
    M = np.zeros((size, size))  # L^-1
    for i in range(size):
        M[i, i] = 1.0 / L[i, i]
        for j in range(i):
            M[i, j] = -(L[i, j:i] * M[j:i, j]).sum() / L[i, i]
    for i in range(size):
        for j in range(size):
            inverse[i, j] = (M[:, i] * M[:, j]).sum()
    least = 1.0 / np.sqrt((inverse**2).sum())
    return least > max(_ROUNDING * np.trace(A), _NOTHING), inverse
