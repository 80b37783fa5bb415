# SPDX-License-Identifier: MIT
"""From what the factors know of a pose to how sure it is, direction by direction."""

from __future__ import annotations

import numpy as np
from scipy.linalg.lapack import dlange, dposv

LEVER = 0.1  # [m], a radian is weighed as this many metres: the size of an object in a hand
# To information about metres in all six directions.
_SCALE = np.array([1 / LEVER] * 3 + [1.0] * 3)
_SCALES = np.outer(_SCALE, _SCALE)
_EYE = np.eye(6)
ROUNDING = 1e-9  # an eigenvalue this far below the largest is rounding
_QUANTILE_95 = 7.815  # of chi squared with 3 degrees of freedom
_NOTHING = 1e-12  # [1/m^2], less is no information: a standard deviation of 1000 km


def all_held(information: np.ndarray, share: float) -> bool:
    """Whether in all six directions the information is at least ``share`` of that in the best one.

    Args:
        information: Information about a pose, (6, 6), rotation [1/rad^2] first, then translation [1/m^2].
        share: Smallest share of the largest eigenvalue, after scaling radians to metres with ``LEVER``.
    """
    eigenvalues = np.linalg.eigvalsh(_SCALES * information)
    return bool(eigenvalues[0] > max(share * eigenvalues[-1], _NOTHING))


def covariance_of(information: np.ndarray) -> np.ndarray:
    """Inverse of an information matrix, (6, 6), infinite along the directions that nothing measures.

    An entry is infinite (with the sign of the growth) where an unmeasured direction involves both its row and
    its column; the other entries are those of the pseudo-inverse.
    """
    scaled = _SCALES * information
    inverse = _well_known(scaled)
    found: np.ndarray = (_pseudo_inverse(scaled) if inverse is None else inverse) * _SCALES
    return found


def _well_known(information: np.ndarray) -> np.ndarray | None:
    """The inverse where it says by itself that all directions are known.

    The least eigenvalue is at least 1 / ||A^-1|| and the largest at most ||A||, so that none needs to be computed.
    """
    inverse: np.ndarray
    _, inverse, failed = dposv(information, _EYE)
    if failed:  # not positive definite
        return None
    least = max(2 * ROUNDING * _norm(information), _NOTHING)
    return inverse if least * _norm(inverse) < 1.0 else None


def _norm(matrix: np.ndarray) -> float:
    """Frobenius norm, whatever the size: a robust loss can leave an information of 1e-160, whose inverse is huge."""
    return float(dlange("F", matrix))


def _pseudo_inverse(information: np.ndarray) -> np.ndarray:
    """The inverse along the eigenvectors whose eigenvalues are no rounding, infinite along the others."""
    eigenvalues, vectors = np.linalg.eigh(information)
    known = eigenvalues > max(ROUNDING * eigenvalues[-1], _NOTHING)
    seen = vectors[:, known]
    covariance = seen / eigenvalues[known] @ seen.T
    if not known.all():
        blind = vectors[:, ~known] @ vectors[:, ~known].T
        size = np.sqrt(np.outer(blind.diagonal(), blind.diagonal()))
        free = np.abs(blind) > ROUNDING * np.maximum(size, 1.0)
        covariance[free] = np.copysign(np.inf, blind[free])
    return covariance  # type: ignore[no-any-return]


def known_inverse(information: np.ndarray) -> np.ndarray:
    """Inverse of an information matrix, (6, 6), along the directions that it knows; zero along the others."""
    scaled = _SCALES * information
    inverse = _well_known(scaled)
    if inverse is None:
        eigenvalues, vectors = np.linalg.eigh(scaled)
        known = eigenvalues > max(ROUNDING * eigenvalues[-1], _NOTHING)
        inverse = vectors[:, known] / eigenvalues[known] @ vectors[:, known].T
    found: np.ndarray = inverse * _SCALES
    return found


def center_ellipsoid(
    R_wo: np.ndarray, covariance: np.ndarray, center_o: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | None:
    """Where an object's centre is with 95 %: half axes [m], (3,), and their directions in the world, (3, 3).

    None where the covariance is infinite somewhere.

    Args:
        R_wo: Rotation of the object in the world, (3, 3).
        covariance: Of the pose's right perturbation, rotation first, (6, 6).
        center_o: The centre in the object's frame [m], (3,).
    """
    if not np.isfinite(covariance).all():
        return None
    x, y, z = np.asarray(center_o, dtype=float).tolist()
    turned = np.array([[0.0, z, -y], [-z, 0.0, x], [y, -x, 0.0]])  # of a small rotation
    moves = np.hstack([turned, np.eye(3)])
    variances, axes = np.linalg.eigh(moves @ covariance @ moves.T)
    axes = axes if np.linalg.det(axes) > 0 else -axes
    return np.sqrt(_QUANTILE_95 * np.maximum(variances, 0.0)), R_wo @ axes
