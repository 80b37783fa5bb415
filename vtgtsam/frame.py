# SPDX-License-Identifier: MIT
"""A measurement, checked once and brought into the form the factors use."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import gtsam
import numpy as np
from numpy.typing import ArrayLike

from .cholesky import factorize, invert
from .compiled import compiled
from .exceptions import NotFiniteError
from .hands.pads import PadSet
from .measurement import Measurement

_ORTHONORMAL = 1e-4  # largest deviation of R'R from I that still counts as rounding
_SYMMETRIC = 1e-6  # largest relative difference of two entries that should be equal
_POSE, _NO_POSE, _NOT_FINITE = 0, 1, 2  # of one matrix
_PADS_NOT_FINITE, _PADS_NO_POSE, _VISUAL = 1, 2, 4  # of a frame's
_IDENTITY = np.eye(4)
_NO_POSES = (
    "T_wp must hold poses: rotation orthonormal, last row 0 0 0 1; check for transposed matrices"
)


class Frame(NamedTuple):
    """One frame's measurements as arrays.

    Attributes:
        time: Instant of the frame [s].
        touching: Which pads report contact, bool, shape (K,).
        T_wp: Pad poses in the world, shape (K, 4, 4).
        T_wo_visual: The visual pose, or None.
        visual_matrix: The same as a matrix, shape (4, 4), or None.
        visual_covariance: Its covariance, shape (6, 6), or None where the configured weight counts.
        visual_whitening: R with R'R the inverse of that covariance, shape (6, 6), or None.
        invalid: What is not finite, in words; empty where all is well.
    """

    time: float
    touching: np.ndarray
    T_wp: np.ndarray
    T_wo_visual: gtsam.Pose3 | None
    visual_matrix: np.ndarray | None
    visual_covariance: np.ndarray | None
    visual_whitening: np.ndarray | None
    invalid: str


def check(measurement: Measurement, hand: PadSet, use_visual_covariance: bool = False) -> Frame:
    """Bring a measurement into arrays.

    Args:
        measurement: What was measured.
        hand: The pads it is about.
        use_visual_covariance: Whether the visual pose's own covariance counts.

    Raises:
        ValueError: Something has the wrong shape or names, or is missing. What is merely not finite is a matter
            of one frame, not of the program: it is named in ``Frame.invalid``.
    """
    visual, matrix = measurement.T_wo_visual, None
    require_pose(measurement.T_wh, "T_wh")
    if visual is not None:
        require_pose(visual, "T_wo_visual")
        matrix = matrix_of(visual)
    touching = contact_bits(measurement.contacts, hand.pad_names)
    invalid = []
    if not math.isfinite(measurement.time):
        invalid.append("time")
    try:
        T_wp = _given_pad_poses(measurement, hand)
    except NotFiniteError:
        T_wp = np.full((len(hand), 4, 4), np.nan)
    faults = _faults(T_wp, _IDENTITY if matrix is None else matrix)
    if faults & _PADS_NOT_FINITE:
        T_wp = np.full((len(hand), 4, 4), np.nan)
        invalid.append("joints, T_wh or T_wp")
    elif faults & _PADS_NO_POSE:
        raise ValueError(_NO_POSES)
    if faults & _VISUAL:
        invalid.append("T_wo_visual")
    covariance, name = _visual_covariance(measurement, use_visual_covariance)
    whitening = None if covariance is None else np.zeros((6, 6))
    if whitening is not None and not _whiten(covariance, whitening):
        invalid.append(name)
    return Frame(
        measurement.time,
        touching,
        T_wp,
        visual,
        matrix,
        covariance,
        whitening,
        ", ".join(invalid),
    )


def _visual_covariance(measurement: Measurement, used: bool) -> tuple[np.ndarray | None, str]:
    """The visual pose's own covariance in this frame, and the name of what gave it."""
    if measurement.visual_sigma is not None:
        sigmas = _shaped(measurement.visual_sigma, (2,), "visual_sigma")
        sigmas = np.where(sigmas > 0, sigmas, np.nan)
        return np.diag(np.repeat(np.square(sigmas), 3)), "visual_sigma"
    if measurement.visual_covariance is not None and used:
        covariance = _shaped(measurement.visual_covariance, (6, 6), "visual_covariance")
        return covariance, "visual_covariance"
    return None, ""


def matrix_of(T: gtsam.Pose3) -> np.ndarray:
    """A pose as a matrix (4, 4) in C order: GTSAM's are in Fortran's, and compiled code is compiled for one of them."""
    return np.ascontiguousarray(T.matrix())


def require_pose(value: object, name: str) -> None:
    """Raise a ValueError, which says how to make one, for what is no gtsam.Pose3."""
    if isinstance(value, gtsam.Pose3):
        return
    shape = getattr(value, "shape", None)
    got = f"a {type(value).__name__}" if shape is None else f"an array of shape {shape}"
    raise ValueError(
        f"{name} must be a gtsam.Pose3, got {got}: gtsam.Pose3(matrix) makes one of a 4x4 matrix"
    )


def require_finite_pose(value: object, name: str) -> None:
    """Raise a ValueError for what is no gtsam.Pose3, or one that holds NaN or infinity."""
    require_pose(value, name)
    if not np.isfinite(value.matrix()).all():  # type: ignore[attr-defined]
        raise ValueError(f"{name} must be finite, got\n{value}")


def _shaped(values: ArrayLike, shape: tuple[int, ...], name: str) -> np.ndarray:
    try:
        array = np.array(values, dtype=np.float64, order="C")  # compiled code wants its own
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} must be numbers of shape {shape}, got {values!r}") from error
    if array.shape != shape:
        raise ValueError(f"{name} must have shape {shape}, got shape {array.shape}: {values!r}")
    return array


@compiled
def _whiten(covariance: Any, whitening: Any) -> bool:
    """R with R'R the inverse of a covariance (6, 6) into ``whitening``; whether there is one.

    R is the inverse of the covariance's Cholesky factor. There is none where the matrix is not finite, not symmetric up
    to rounding, or not positive definite.
    """
    for i in range(6):
        for j in range(i):
            a, b = covariance[i, j], covariance[j, i]
            if not abs(a - b) <= _SYMMETRIC * abs(b):  # also where one is not finite
                return False
    L = np.empty((6, 6))
    if not factorize(covariance, 0.0, L):
        return False
    invert(L, whitening)
    return True


def contact_bits(contacts: ArrayLike | Mapping[str, bool], names: tuple[str, ...]) -> np.ndarray:
    """Contact bits as a bool array in ``names`` order, shape (K,).

    Raises:
        ValueError: A pad is missing, the length is wrong, or a value is neither 0 nor 1.
    """
    if isinstance(contacts, Mapping):
        missing = [name for name in names if name not in contacts]
        if missing:
            raise ValueError(
                f"contacts must name every pad, missing: {', '.join(missing)}; got {sorted(contacts)}"
            )
        contacts = [contacts[name] for name in names]
    bits = np.array(contacts)  # compiled code wants its own
    if bits.shape != (len(names),):
        raise ValueError(
            f"contacts must have shape ({len(names)},), one bit a pad, got {bits.shape}"
        )
    if bits.dtype != bool:
        if bits.dtype.kind not in "iuf" or not np.isin(bits, (0, 1)).all():
            raise ValueError(
                f"contacts must be bits, got {bits.tolist()}; threshold the pads' values first"
            )
        bits = bits.astype(bool)
    return bits


def pad_poses(measurement: Measurement, hand: PadSet) -> np.ndarray:
    """Pad poses in the world, shape (K, 4, 4): the given ones, or from the hand's kinematics.

    Raises:
        ValueError: Neither pad poses nor (for a hand with kinematics) joints are given, or they are malformed.
        NotFiniteError: A joint angle or a pose is not finite.
    """
    T_wp = _given_pad_poses(measurement, hand)
    faults = _faults(T_wp, _IDENTITY)
    if faults & _PADS_NOT_FINITE:
        raise NotFiniteError("the pad poses that T_wp, or joints and T_wh give are not finite")
    if faults & _PADS_NO_POSE:
        raise ValueError(_NO_POSES)
    return T_wp


def _given_pad_poses(measurement: Measurement, hand: PadSet) -> np.ndarray:
    """The same, not yet known to be poses."""
    if measurement.T_wp is None:
        from .hands.model import HandModel  # brings MuJoCo, which a PadSet does without

        if not isinstance(hand, HandModel):
            raise ValueError(
                "a PadSet has no kinematics: give each frame's pad poses in Measurement.T_wp, shape (K, 4, 4)"
            )
        if measurement.joints is None:
            raise ValueError("the measurement has neither joints nor T_wp; give one of them")
        return hand.pad_transforms(measurement.joints, measurement.T_wh)
    return _shaped(measurement.T_wp, (len(hand), 4, 4), "T_wp")


@compiled
def _faults(T_wp: Any, T_visual: Any) -> int:
    """What keeps pads' matrices (K, 4, 4) and a visual one (4, 4) from being poses: a sum of the faults' numbers."""
    found = 0
    for n in range(len(T_wp)):
        fault = _fault(T_wp[n])
        if fault == _NOT_FINITE:
            found |= _PADS_NOT_FINITE
        elif fault == _NO_POSE:
            found |= _PADS_NO_POSE
    if _fault(T_visual) != _POSE:
        found |= _VISUAL
    return found


@compiled
def _fault(T: Any) -> int:
    """What keeps a matrix (4, 4) from being a pose, up to rounding."""
    for i in range(4):
        for j in range(4):
            if not np.isfinite(T[i, j]):
                return _NOT_FINITE
    for i in range(3):
        if abs(T[3, i]) > _ORTHONORMAL:
            return _NO_POSE
        for j in range(3):
            dot = T[i, 0] * T[j, 0] + T[i, 1] * T[j, 1] + T[i, 2] * T[j, 2]
            if abs(dot - (i == j)) > _ORTHONORMAL:
                return _NO_POSE
    return _NO_POSE if abs(T[3, 3] - 1.0) > _ORTHONORMAL else _POSE
