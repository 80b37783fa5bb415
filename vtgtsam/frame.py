# SPDX-License-Identifier: MIT
"""A measurement, checked once and brought into the hand's frame, where the factors live."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple

import gtsam
import numpy as np
from numpy.typing import ArrayLike

from .compiled import compiled_in_place
from .exceptions import NotFiniteError
from .faults.words import (
    COVARIANCE_UNUSABLE,
    HAND_POSE_NOT_FINITE,
    PADS_NOT_FINITE,
    VISION_NOT_FINITE,
)
from .hands.motion import hand_motion
from .hands.pads import PadSet
from .measurement import Measurement

if TYPE_CHECKING:
    from .hands.model import HandModel

_ORTHONORMAL = 1e-4  # largest deviation of R'R from I that still counts as rounding
_FAR = 1e7  # [m]
_ORIGIN = gtsam.Pose3()
_SYMMETRIC = 1e-6  # largest difference of two entries that should be equal, as correlations


class Hand(NamedTuple):
    """Where a hand and its pads are at one instant.

    Attributes:
        T_wh: Pose of the hand in the world.
        T_hp: Pad poses in the hand, shape (K, 4, 4).
        joints: Joint angles [rad], shape (J,), or None where the pads' poses were given.
    """

    T_wh: gtsam.Pose3
    T_hp: np.ndarray
    joints: np.ndarray | None = None


class Frame(NamedTuple):
    """One frame's measurements, in the hand's frame.

    Attributes:
        time: Instant of the frame [s].
        touching: Which pads report contact, bool, shape (K,).
        T_wh: Pose of the hand in the world.
        T_hp: Pad poses in the hand, shape (K, 4, 4); NaN where they are not known.
        joints: Joint angles [rad], shape (J,), or None where the pads' poses were given.
        T_ho_visual: The visual pose, or None.
        visual_covariance: Its covariance, shape (6, 6), or None where the configured weight counts.
        faults: What cannot be used, in the fixed words of ``faults``.
        suspect: Whether vision has jumped away from where it was believed, and has not been believed since.
        visual_correlation: How long the visual pose's errors stay alike [s].
    """

    time: float
    touching: np.ndarray
    T_wh: gtsam.Pose3
    T_hp: np.ndarray
    joints: np.ndarray | None
    T_ho_visual: gtsam.Pose3 | None
    visual_covariance: np.ndarray | None
    faults: tuple[str, ...] = ()
    suspect: bool = False
    visual_correlation: float = 0.0

    @property
    def T_wo_visual(self) -> gtsam.Pose3 | None:
        """The visual pose in the world, or None."""
        return None if self.T_ho_visual is None else self.T_wh.compose(self.T_ho_visual)

    @property
    def pads_known(self) -> bool:
        """Whether it is known where the pads are."""
        return bool(np.isfinite(self.T_hp[0, 0, 0]))

    def without_pads(self) -> Frame:
        """The frame with its hand's pads left out."""
        return self._replace(T_hp=np.full_like(self.T_hp, np.nan), joints=None)


def check(
    measurement: Measurement,
    pads: PadSet,
    use_visual_covariance: bool = True,
    before: Hand | None = None,
) -> Frame:
    """A measurement as the factors use it.

    Args:
        measurement: What was measured.
        pads: The hand that it is about.
        use_visual_covariance: Whether the visual pose's own covariance counts.
        before: The hand a frame ago, from which a hand that is known by its pads alone has moved.

    Raises:
        ValueError: Something has the wrong shape or names, or is missing. What is merely not finite is a matter
            of one frame, not of the program: it is left out and named in ``Frame.faults``.
    """
    faults = []
    if not isinstance(measurement.time, int | float | np.integer | np.floating):
        raise ValueError(f"time must be a number of seconds, got {measurement.time!r:.60}")
    touching = contact_bits(measurement.contacts, pads.pad_names)
    try:
        hand = hand_of(measurement, pads, before)
    except NotFiniteError as error:
        faults.append(error.fault)
        T_wh = gtsam.Pose3() if before is None else before.T_wh
        if error.fault != HAND_POSE_NOT_FINITE and measurement.T_wh is not None:
            T_wh = measurement.T_wh
        hand = Hand(T_wh, np.full((len(pads), 4, 4), np.nan))
    T_wo_visual = measurement.T_wo_visual
    if T_wo_visual is not None:
        require_pose(T_wo_visual, "T_wo_visual")
        if not is_pose(T_wo_visual.matrix()):
            faults.append(VISION_NOT_FINITE)
            T_wo_visual = None
    covariance = _visual_covariance(measurement, use_visual_covariance)
    if covariance is not None and not _is_covariance(covariance):
        faults.append(COVARIANCE_UNUSABLE)
        covariance = None
    T_ho_visual = None if T_wo_visual is None else hand.T_wh.between(T_wo_visual)
    return Frame(
        measurement.time,
        touching,
        *hand,
        T_ho_visual,
        covariance,
        tuple(faults),
        visual_correlation=_seconds(measurement.visual_correlation, "visual_correlation"),
    )


def hand_of(measurement: Measurement, pads: PadSet, before: Hand | None = None) -> Hand:
    """Where a measurement's hand and pads are.

    By joints, the hand is at T_wh, or at the world's origin. By pad poses without T_wh, it moves with its pads from
    ``before`` on, and is at the world's origin where there is none.

    Raises:
        ValueError: Neither pad poses nor (for a hand with kinematics) joints are given, or they are malformed.
        NotFiniteError: A joint angle or a pose is not finite.
    """
    T_wh = measurement.T_wh
    if T_wh is not None:
        require_pose(T_wh, "T_wh")
        if not is_pose(T_wh.matrix()):
            raise NotFiniteError("T_wh is not a finite pose", HAND_POSE_NOT_FINITE)
    if measurement.T_wp is None:
        joints, T_hp = _pads_by_joints(measurement, pads)
        return Hand(_ORIGIN if T_wh is None else T_wh, T_hp, joints)
    T_wp = _shaped(measurement.T_wp, (len(pads), 4, 4), "T_wp")
    if not is_pose(T_wp):
        if not np.abs(T_wp).max() < _FAR:
            raise NotFiniteError("T_wp is not finite", PADS_NOT_FINITE)
        raise ValueError(
            "T_wp must hold poses: rotation orthonormal, last row 0 0 0 1; check for transposed matrices"
        )
    if T_wh is None:
        if before is None:
            return Hand(_ORIGIN, T_wp)
        T_wh = hand_motion(pads, before.T_wh.matrix() @ before.T_hp, T_wp).compose(before.T_wh)
    return Hand(T_wh, T_wh.inverse().matrix() @ T_wp)


def _pads_by_joints(measurement: Measurement, pads: PadSet) -> tuple[np.ndarray, np.ndarray]:
    """Joint angles (J,) and pad poses in the hand (K, 4, 4)."""
    from .hands.model import HandModel  # brings MuJoCo, which a PadSet does without

    if not isinstance(pads, HandModel):
        raise ValueError(
            "a PadSet has no kinematics: give each frame's pad poses in Measurement.T_wp, shape (K, 4, 4)"
        )
    joints = joints_of(measurement, pads)
    return joints, pads.pad_transforms(joints)


def joints_of(measurement: Measurement, hand: HandModel) -> np.ndarray:
    """Joint angles in the order of the hand's ``joint_names`` [rad], shape (J,).

    Raises:
        ValueError: They are not given, or ``HandModel.joint_array`` refuses them.
    """
    if measurement.joints is None:
        raise ValueError("the measurement has neither joints nor T_wp; give one of them")
    return hand.joint_array(measurement.joints)


def _visual_covariance(measurement: Measurement, used: bool) -> np.ndarray | None:
    """The visual pose's own covariance in this frame, shape (6, 6)."""
    if measurement.visual_sigma is not None:
        sigmas = _shaped(measurement.visual_sigma, (2,), "visual_sigma")
        sigmas = np.where(sigmas > 0, sigmas, np.nan)
        return np.diag(np.repeat(np.square(sigmas), 3))
    if measurement.visual_covariance is not None and used:
        return _shaped(measurement.visual_covariance, (6, 6), "visual_covariance")
    return None


def _is_covariance(matrix: np.ndarray) -> bool:
    """Whether a matrix (6, 6) is finite, symmetric up to rounding, and positive definite."""
    variances = matrix.diagonal()
    if not (np.isfinite(matrix).all() and (variances > 0.0).all()):
        return False
    # Entries are compared as correlations: those that should be zero are rounding, which need not be symmetric.
    if not (
        np.abs(matrix - matrix.T) <= _SYMMETRIC * np.sqrt(np.outer(variances, variances))
    ).all():
        return False
    try:
        return bool(np.isfinite(np.linalg.inv(np.linalg.cholesky(matrix))).all())
    except np.linalg.LinAlgError:
        return False


def is_pose(T: np.ndarray) -> bool:
    """Whether matrices (..., 4, 4) are poses up to rounding, finite and on this planet."""
    return _are_poses(np.ascontiguousarray(T).reshape(-1, 4, 4))


@compiled_in_place
def _are_poses(T: np.ndarray) -> bool:
    """Whether R R' = I and the last row is 0 0 0 1 for matrices (N, 4, 4), and no translation is out of reach."""
    off, farthest = 0.0, 0.0
    for A in T:
        for i in range(3):
            for j in range(3):
                dot = A[i, 0] * A[j, 0] + A[i, 1] * A[j, 1] + A[i, 2] * A[j, 2]
                off += (dot - (i == j)) ** 2
            off += A[3, i] ** 2
        off += (A[3, 3] - 1.0) ** 2
        farthest += A[0, 3] ** 2 + A[1, 3] ** 2 + A[2, 3] ** 2
    return off < _ORTHONORMAL**2 and farthest < _FAR**2  # neither holds for what is not finite


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
    if not is_pose(value.matrix()):  # type: ignore[attr-defined]
        raise ValueError(f"{name} must be finite and its rotation orthonormal, got\n{value}")


def _seconds(value: object, name: str) -> float:
    if isinstance(value, int | float | np.integer | np.floating) and 0.0 <= value < math.inf:
        return float(value)
    raise ValueError(f"{name} must be a finite number of seconds, at least 0, got {value!r:.60}")


def _shaped(values: ArrayLike, shape: tuple[int, ...], name: str) -> np.ndarray:
    try:
        array = np.array(values, dtype=np.float64, order="C")  # its own, to be kept as it is
    except (TypeError, ValueError) as error:
        raise ValueError(f"{name} must be numbers of shape {shape}, got {values!r:.80}") from error
    if array.shape != shape:
        raise ValueError(f"{name} must have shape {shape}, got shape {array.shape}: {values!r:.80}")
    return array


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
    bits = np.array(contacts)  # its own, to be kept as it is
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
