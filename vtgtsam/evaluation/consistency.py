# SPDX-License-Identifier: MIT
r"""Whether poses are as uncertain as their covariances say.

With the error e = Log(T_est^-1 T_true) of a pose and its covariance S, e' S^-1 e is distributed as chi^2 with as many
degrees of freedom as S has finite directions, if S is right. Divided by that number (NEES, normalised estimation error
squared) it is 1 on average: more where the covariance promises too much, less where it is too careful. The 95 % region
holds the truth where e' S^-1 e is below chi^2's 95 % quantile.

A pose that looks the same as the truth is as good: of an object's discrete symmetries the nearest counts, a turn about
its axis of revolution does not count, and of a ball only the centre does.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gtsam
import numpy as np
import scipy.stats

Symmetry = dict[str, Any]

LEVELS = (0.5, 0.8, 0.95)  # of the regions whose coverage is counted
PARALLEL = 1e-6


def nees(
    T_est: Sequence[gtsam.Pose3],
    covariances: np.ndarray,
    T_true: Sequence[gtsam.Pose3],
    symmetry: Symmetry | None = None,
) -> tuple[np.ndarray, np.ndarray]:
    """Squared errors in units of their covariances, per degree of freedom, and these degrees, each (N,).

    Args:
        T_est: Estimates.
        covariances: Of right perturbations, rotation first, shape (N, 6, 6); infinite along what nothing measures.
        T_true: True poses.
        symmetry: The object's entry of BOP's ``models_info.json``, or None.

    Returns:
        NaN and 0 where no direction is finite.
    """
    if not len(T_est):
        return np.zeros(0), np.zeros(0, dtype=int)
    axes = _axes(symmetry)
    same = [T_true] + [[T.compose(turn) for T in T_true] for turn in _turns(symmetry)]
    if len(axes) == 2:
        point = np.asarray(axes[0][3:6])
        return _best(np.array([_at_point(T_est, same[0], point)]), _of_point(covariances, point))
    if axes:
        same = [[_untwisted(*pair, axes[0]) for pair in zip(T_est, T, strict=True)] for T in same]
    errors = [[a.localCoordinates(b) for a, b in zip(T_est, T, strict=True)] for T in same]
    return _best(np.array(errors), covariances, _twist(axes[0]) if axes else None)


def covered(nees_values: np.ndarray, dof: np.ndarray, level: float) -> np.ndarray:
    """Whether the region of that probability holds the truth, bool (N,); False where there is no NEES."""
    bounds = scipy.stats.chi2.ppf(level, np.maximum(dof, 1))
    with np.errstate(invalid="ignore"):
        return np.asarray(nees_values * dof <= bounds)


def _best(
    errors: np.ndarray, covariances: np.ndarray, free: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Least NEES over K equal truths, from errors (K, N, D); ``free`` (D,) is a direction that does not count."""
    known = np.isfinite(np.diagonal(covariances, axis1=1, axis2=2))
    information = np.array([_inverse(S, k) for S, k in zip(covariances, known, strict=True)])
    dof = known.sum(axis=1)
    squared = np.einsum("kni,nij,knj->kn", errors, information, errors)
    if free is not None:
        along = information @ free
        size = along @ free
        counts = size > 1e-12 * np.maximum(np.trace(information, axis1=1, axis2=2), 1e-300)
        pulled = np.einsum("kni,ni->kn", errors, along) ** 2 / np.where(counts, size, np.inf)
        squared = squared - pulled
        dof = dof - counts
    with np.errstate(invalid="ignore", divide="ignore"):
        return np.where(dof > 0, squared.min(axis=0) / dof, np.nan), dof


def _inverse(covariance: np.ndarray, known: np.ndarray) -> np.ndarray:
    """Information of the finite directions, zero for the others, (D, D)."""
    information = np.zeros_like(covariance)
    if known.any():
        block = np.ix_(known, known)
        information[block] = np.linalg.pinv(covariance[block], hermitian=True)
    return information


def _turns(symmetry: Symmetry | None) -> list[gtsam.Pose3]:
    """Discrete symmetries as right factors of a pose [m]."""
    turns = []
    for numbers in (symmetry or {}).get("symmetries_discrete", []):
        T = np.reshape(np.asarray(numbers, dtype=np.float64), (4, 4)).copy()
        T[:3, 3] *= 1e-3
        turns.append(gtsam.Pose3(T))
    return turns


def _axes(symmetry: Symmetry | None) -> list[np.ndarray]:
    """Axes of revolution as direction and a point [m], shape (6,); two where the object is a ball."""
    found: list[np.ndarray] = []
    for entry in (symmetry or {}).get("symmetries_continuous", []):
        axis = np.asarray(entry["axis"], dtype=np.float64)
        axis = axis / np.linalg.norm(axis)
        point = 1e-3 * np.asarray(entry.get("offset", (0, 0, 0)), dtype=np.float64)
        if not found or np.linalg.norm(np.cross(found[0][:3], axis)) > PARALLEL:
            found.append(np.concatenate([axis, point]))
    return found[:2]


def _twist(axis: np.ndarray) -> np.ndarray:
    """The right perturbation that turns an object about an axis, shape (6,)."""
    return np.concatenate([axis[:3], np.cross(axis[3:], axis[:3])])


def _untwisted(T_est: gtsam.Pose3, T_true: gtsam.Pose3, axis: np.ndarray) -> gtsam.Pose3:
    """The truth turned about the object's axis until it lies nearest to the estimate."""
    q: Any = T_true.rotation().between(T_est.rotation()).toQuaternion()
    angle = 2.0 * np.arctan2(np.dot([q.x(), q.y(), q.z()], axis[:3]), q.w())
    return T_true.compose(gtsam.Pose3.Expmap(angle * _twist(axis)))


def _at_point(
    T_est: Sequence[gtsam.Pose3], T_true: Sequence[gtsam.Pose3], point_o: np.ndarray
) -> np.ndarray:
    """Where the truth's point lies from the estimate's, in the estimate's frame [m], shape (N, 3)."""
    return np.array(
        [
            T.transformTo(true.transformFrom(point_o)) - point_o
            for T, true in zip(T_est, T_true, strict=True)
        ]
    )


def _of_point(covariances: np.ndarray, point_o: np.ndarray) -> np.ndarray:
    """Covariances of that point, shape (N, 3, 3)."""
    if np.linalg.norm(point_o) < 1e-9:  # where turns that nothing measures do not reach
        return covariances[:, 3:, 3:]
    J = np.hstack([-np.asarray(gtsam.Rot3.Hat(point_o)), np.eye(3)])
    with np.errstate(invalid="ignore"):
        moved = J @ covariances @ J.T
    return np.where(np.isfinite(moved), moved, np.inf)
