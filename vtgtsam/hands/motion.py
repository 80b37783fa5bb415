# SPDX-License-Identifier: MIT
r"""How a hand that is known by its pads alone has moved between two frames.

Of all rigid motions M the one that brings the pads of the frame before closest to those of now,

    M = argmin  sum_i || c_i(t) - M c_i(t-1) ||^2

over the corners c_i of all pads' contact faces in the world. Fingers that close move some pads against the others; what
most pads share is the hand. The minimum is known in closed form (Arun, Huang, Blostein 1987, by a singular value
decomposition).
"""

from __future__ import annotations

import gtsam
import numpy as np

from .pads import PadSet


def hand_motion(pads: PadSet, T_wp_before: np.ndarray, T_wp_now: np.ndarray) -> gtsam.Pose3:
    """The motion M in the world that takes the pads' poses (K, 4, 4) of before best to those of now."""
    before, now = _corners_w(pads, T_wp_before), _corners_w(pads, T_wp_now)
    middle_before, middle_now = before.mean(axis=0), now.mean(axis=0)
    U, _, Vt = np.linalg.svd((now - middle_now).T @ (before - middle_before))
    flip = np.diag([1.0, 1.0, np.linalg.det(U @ Vt)])  # a rotation, not a mirror
    R = U @ flip @ Vt
    return gtsam.Pose3(gtsam.Rot3(R), middle_now - R @ middle_before)


def _corners_w(pads: PadSet, T_wp: np.ndarray) -> np.ndarray:
    """Corners of the pads' contact faces [m], shape (4 K, 3)."""
    half = np.array([pad.size for pad in pads.pads]) / 2
    signs = np.array([(1, 1, 0), (1, -1, 0), (-1, 1, 0), (-1, -1, 0)])
    corners_p = signs * np.column_stack([half, np.zeros(len(half))])[:, None, :]
    corners_w: np.ndarray = corners_p @ np.swapaxes(T_wp[:, :3, :3], -1, -2)
    corners_w += T_wp[:, None, :3, 3]
    return corners_w.reshape(-1, 3)
