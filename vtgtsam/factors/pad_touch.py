# SPDX-License-Identifier: MIT
r"""Self-touch factor: two pads of the hand that report contact with nothing between them touch each other.

The joints are at q - dq where they are measured at q. Pad a's grid points p and pad b's face, in the hand, are a
distance

    d(dq) = min_p phi_b(p_a(q - dq)),    phi_b the distance to b's face, or with a and b exchanged where that is less,

apart [m]. A touch makes that what the flat parts of touching pads stand off, for their rims are round. With the unit
gradient n of phi_b at the closest point p,

    dd/ddq = -n . (dp_a/dq - dp_b/dq),

p_b the point of pad b's link that lies there. No object and no camera are involved: the factor sees joints' zeros alone
(after Tenhumberg, Sievers, Baeuml 2023, who calibrate a hand by pairwise contacts).
"""

from __future__ import annotations

from typing import NamedTuple

import gtsam
import numpy as np

from ..hands.model import HandModel
from ..hands.pads import RIM
from .checked import checked_factor


class PadGap(NamedTuple):
    """Where two pads are closest.

    Attributes:
        distance: Between them [m], negative where they overlap.
        point_h: The closest point, in the hand [m], shape (3,).
        normal_h: Gradient of the distance for the pad ``moved``, in the hand, shape (3,).
        moved: Which of the two the point is on, as an index of the hand's pads.
        still: The other one.
    """

    distance: float
    point_h: np.ndarray
    normal_h: np.ndarray
    moved: int
    still: int


def face_distance(points: np.ndarray, size: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Distances of points to a pad, shape (N,), and their gradients, shape (N, 3).

    Above its face, and beside it, that is the distance to the face; below the face the negative depth, however deep: a
    pad is thin, and where zeros are not known yet pads may seem to have gone through each other.

    Args:
        points: In the pad's frame, whose origin is the face's centre [m], shape (N, 3).
        size: Lengths of the face, without its round rim [m], shape (2,).
    """
    beside = np.maximum(np.abs(points[:, :2]) - size / 2, 0.0) * np.sign(points[:, :2])
    off = np.column_stack([beside, np.maximum(points[:, 2], 0.0)])
    far = np.linalg.norm(off, axis=1)
    below = far == 0.0
    gradients = off / np.where(below, 1.0, far)[:, None]
    gradients[below] = [0.0, 0.0, 1.0]
    return np.where(below, points[:, 2], far), gradients


def pad_gap(hand: HandModel, T_hp: np.ndarray, a: int, b: int) -> PadGap:
    """Where two pads are closest.

    Args:
        hand: The hand.
        T_hp: Its pads' poses in the hand, shape (K, 4, 4).
        a: Index of one.
        b: Index of the other one.
    """
    return min((_gap(hand, T_hp, *pair) for pair in ((a, b), (b, a))), key=lambda gap: gap.distance)


def _gap(hand: HandModel, T_hp: np.ndarray, moved: int, still: int) -> PadGap:
    """The point of pad ``moved`` that is closest to the face of pad ``still``."""
    T, T_face = T_hp[moved], T_hp[still]
    points_h = hand.pads[moved].points_p @ T[:3, :3].T + T[:3, 3]
    points = (points_h - T_face[:3, 3]) @ T_face[:3, :3]
    distances, gradients = face_distance(points, hand.pads[still].size - 2 * RIM)
    k = int(np.argmin(distances))
    return PadGap(float(distances[k]), points_h[k], T_face[:3, :3] @ gradients[k], moved, still)


def touch_residual(
    hand: HandModel, joints: np.ndarray, zeros: np.ndarray, a: int, b: int
) -> tuple[float, np.ndarray]:
    """The distance of two pads [m], and its derivative by the joints' zeros, shape (J,).

    Args:
        hand: The hand.
        joints: Joint angles as measured [rad], shape (J,).
        zeros: The joints' zeros dq [rad], shape (J,).
        a: Index of one pad.
        b: Index of the other one.
    """
    true = joints - zeros
    gap = pad_gap(hand, hand.pad_transforms(true), a, b)
    points_h = np.tile(gap.point_h, (len(hand), 1))
    gradients_h = np.zeros((len(hand), 3))
    gradients_h[gap.moved], gradients_h[gap.still] = gap.normal_h, -gap.normal_h
    return gap.distance, hand.zero_jacobian(true, points_h, gradients_h).sum(axis=0)


def touch_factor(
    zeros_key: int,
    hand: HandModel,
    joints: np.ndarray,
    a: int,
    b: int,
    stand_off: float,
    noise: gtsam.noiseModel.Base,
) -> gtsam.CustomFactor:
    """Have two pads touch each other.

    Args:
        zeros_key: Key of the joints' zeros dq, a vector of dimension J.
        hand: The hand.
        joints: Joint angles as measured [rad], shape (J,).
        a: Index of one pad.
        b: Index of the other one.
        stand_off: What the flat parts of pads that touch are apart [m].
        noise: Noise model of dimension 1, sigma in [m].
    """
    measured = np.array(joints, dtype=np.float64)

    def error(
        factor: gtsam.CustomFactor, values: gtsam.Values, jacobians: list[np.ndarray] | None
    ) -> np.ndarray:
        distance, jacobian = touch_residual(hand, measured, values.atVector(zeros_key), a, b)
        if jacobians is not None:
            jacobians[0] = jacobian[None]
        return np.array([distance - stand_off])

    return checked_factor(noise, [zeros_key], error, [len(measured)])
