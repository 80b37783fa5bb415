# SPDX-License-Identifier: MIT
r"""Whether a grasp says the same of the robot as the others do.

Without grasp g the posterior of the offsets has the information L = P^-1 - H and lies at c - L^-1 eta, seen from the
solution c. The grasp alone pulls from there by

    nu = eta + H L^-1 eta,    whose covariance is H + H L^-1 H where all is as it should be,

so nu' cov^-1 nu is the number of directions that the grasp sees, give or take (NEES 1 a direction).
"""

from __future__ import annotations

import numpy as np

SEEN = 0.1  # least information of a direction that a grasp sees, in units of what the others know


def nees(information: np.ndarray, pull: np.ndarray, covariance: np.ndarray) -> float:
    """How far a grasp is from the others in units of what both are unsure of, a direction; 0 where it sees none.

    Args:
        information: H of the grasp, shape (N, N).
        pull: eta, shape (N,).
        covariance: P of all grasps together, shape (N, N).
    """
    others = np.linalg.inv(covariance) - information
    L = np.linalg.cholesky(np.linalg.inv((others + others.T) / 2))
    H = L.T @ information @ L  # in units of what the others know
    eta = L.T @ pull
    eigenvalues, vectors = np.linalg.eigh((H + H.T) / 2)
    sees = eigenvalues > SEEN
    if not sees.any():
        return 0.0
    along, seen = vectors.T[sees] @ eta, eigenvalues[sees]
    squared = np.square(along * (1.0 + seen)) / (seen + np.square(seen))
    return float(squared.mean())
