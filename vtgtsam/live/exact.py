# SPDX-License-Identifier: MIT
"""Values as they come out of a recording, whose format rounds their last bits: live and replay get the same."""

from __future__ import annotations

from types import SimpleNamespace

import gtsam
import numpy as np

from ..recording import messages
from ..recording.covariance import ros_from_tangent, tangent_from_ros


def as_recorded(pose: gtsam.Pose3) -> gtsam.Pose3:
    """A pose as it comes out of a recording.

    Raises:
        ValueError: It is none.
    """
    fields = {name: SimpleNamespace(**part) for name, part in messages.pose_fields(pose).items()}
    recorded = messages.pose_from_fields(SimpleNamespace(**fields))
    if recorded is None:
        raise ValueError(f"not a pose: {pose.matrix()}")
    return recorded


def covariance_as_recorded(covariance: np.ndarray, pose: gtsam.Pose3) -> np.ndarray:
    """A covariance of the pose's right perturbation, (6, 6), as it comes out of a recording."""
    ros = ros_from_tangent(covariance, pose.rotation())
    return tangent_from_ros(ros, as_recorded(pose).rotation())
