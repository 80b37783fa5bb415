# SPDX-License-Identifier: MIT
r"""Simulated recordings of before held, with each visual pose, the tracker's covariance plus the camera's.

The camera was 2 mm and one degree off in a random direction, turned about the world's origin: a left perturbation of
T_wo with the covariance P below, so that what was added, and is taken off here, is

    Ad(T_wo^-1) P Ad(T_wo^-1)'.

What remains is the tracker's own, as a ``Measurement`` wants it: a calibration counts the camera by itself.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping

import gtsam
import numpy as np

from . import names
from .poses import PoseStream

ROTATION, TRANSLATION = (
    math.radians(1.0),
    0.002,
)  # [rad], [m], in any direction: divided among three axes
_VARIANCES = np.repeat([ROTATION**2 / 3.0, TRANSLATION**2 / 3.0], 3)


def holds_camera(info: Mapping[str, str]) -> bool:
    """Whether a recording of this metadata holds such covariances."""
    own = info.get(names.VISUAL_COVARIANCE) == "tracker"
    return not own and info.get("calibration_error") == "yes"


def of_tracker(stream: PoseStream) -> PoseStream:
    """Visual poses in the world with the camera's share taken off their covariances."""
    pairs = zip(stream.poses, stream.covariances, strict=True)
    own = [None if P is None else without_camera(T_wo, P) for T_wo, P in pairs]
    return dataclasses.replace(stream, covariances=own)


def camera_share(T_wo: gtsam.Pose3) -> np.ndarray:
    """What was added for the camera to the covariance of a visual pose, shape (6, 6)."""
    adjoint = T_wo.inverse().AdjointMap()
    share: np.ndarray = adjoint @ np.diag(_VARIANCES) @ adjoint.T
    return share


def without_camera(T_wo: gtsam.Pose3, covariance: np.ndarray) -> np.ndarray | None:
    """The tracker's own covariance, shape (6, 6), or None where nothing is left of it: it was made otherwise.

    Args:
        T_wo: The visual pose.
        covariance: With the camera's share, shape (6, 6).
    """
    own: np.ndarray = covariance - camera_share(T_wo)
    own = (own + own.T) / 2
    least = np.linalg.eigvalsh(own)[0]
    return own if least > 0.0 else None
