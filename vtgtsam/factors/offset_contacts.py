# SPDX-License-Identifier: MIT
r"""Contact factor of a whole recording: pads that touch are at the object's surface, up to an offset each.

    r_k(T_ho, dq, b) = s(phi_k(T_ho, dq) - b_k),    s(d) = d / gap_sigma where d > 0, d / overlap_sigma elsewhere

for each pad k in contact, in sigmas. phi_k is that of ``jointed_pads``. b_k is what a contact of pad k stands off the
mesh, the same in all of a recording: a pad touches with its rim, where no point is sought, or the object is not quite
its mesh. A gap and an overlap are weighed apart, since pads yield and bits come late, but little gets into a solid.
"""

from __future__ import annotations

import gtsam
import numpy as np

from .checked import POSE3_DIMENSION, checked_factor
from .jointed_pads import JointedPads


def contact_residual(
    distances: np.ndarray, offsets: np.ndarray, gap_sigma: float, overlap_sigma: float
) -> tuple[np.ndarray, np.ndarray]:
    """How far touching pads are from where they should be, in sigmas, and the derivative by distance [1/m], both (N,).

    Args:
        distances: Signed distances of the closest points [m], shape (N,).
        offsets: What the contacts stand off the mesh [m], shape (N,).
        gap_sigma: Standard deviation of a gap [m].
        overlap_sigma: Standard deviation of an overlap [m].
    """
    off = distances - offsets
    slope = np.where(off > 0.0, 1.0 / gap_sigma, 1.0 / overlap_sigma)
    return off * slope, slope


def contact_factor(
    key: int,
    zeros_key: int,
    offsets_key: int,
    pads: JointedPads,
    gap_sigma: float,
    overlap_sigma: float,
    noise: gtsam.noiseModel.Base,
) -> gtsam.CustomFactor:
    """Put the object's surface onto the pads that report contact.

    Args:
        key: Key of the object's pose T_ho.
        zeros_key: Key of the joints' zeros dq, a vector of dimension J.
        offsets_key: Key of the contacts' offsets b, a vector with one entry a pad of the hand.
        pads: The frame's pads.
        gap_sigma: Standard deviation of a gap [m].
        overlap_sigma: Standard deviation of an overlap [m].
        noise: Noise model whose dimension is the number of touching pads, of a residual that is in sigmas.
    """
    (touching,) = pads.touching.nonzero()
    chosen = np.eye(len(pads.touching))[touching]

    def error(
        factor: gtsam.CustomFactor, values: gtsam.Values, jacobians: list[np.ndarray] | None
    ) -> np.ndarray:
        T_ho, zeros = values.atPose3(key), values.atVector(zeros_key)
        contacts = pads.at(T_ho, zeros)
        offsets = values.atVector(offsets_key)[touching]
        residual, slope = contact_residual(
            contacts.distances[touching], offsets, gap_sigma, overlap_sigma
        )
        if jacobians is not None:
            jacobians[0] = slope[:, None] * contacts.jacobians[touching]
            jacobians[1] = slope[:, None] * pads.derivative_by_zeros(T_ho, zeros)[touching]
            jacobians[2] = -slope[:, None] * chosen
        return residual

    dimensions = [POSE3_DIMENSION, pads.joints, len(pads.touching)]
    return checked_factor(noise, [key, zeros_key, offsets_key], error, dimensions)
