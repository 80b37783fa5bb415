# SPDX-License-Identifier: MIT
r"""Pose covariances between ROS and GTSAM.

ROS (REP 103, geometry_msgs/msg/PoseWithCovariance) has translation first, then rotation, both about
the fixed axes of the frame the pose is given in: t + dt and Exp(dw) R. GTSAM perturbs on the right,
rotation first: T Exp(xi), that is R Exp(w) and t + R v. So, to first order,

    xi = [w, v] = [R^T dw, R^T dt] = A [dt, dw],    A = [[0, R^T], [R^T, 0]]

and a covariance S of [dt, dw] becomes A S A^T.
"""

from __future__ import annotations

import gtsam
import numpy as np


def _ros_to_tangent(rotation: gtsam.Rot3) -> np.ndarray:
    A = np.zeros((6, 6))
    A[:3, 3:] = A[3:, :3] = rotation.matrix().T
    return A


def tangent_from_ros(covariance: np.ndarray, rotation: gtsam.Rot3) -> np.ndarray:
    """Covariance of the right perturbation [rotation, translation], shape (6, 6), from ROS's.

    Args:
        covariance: ROS's covariance, translation first, fixed axes [m^2, rad^2], shape (6, 6).
        rotation: Rotation of the pose the covariance belongs to.
    """
    A = _ros_to_tangent(rotation)
    tangent: np.ndarray = A @ covariance @ A.T
    return tangent


def ros_from_tangent(covariance: np.ndarray, rotation: gtsam.Rot3) -> np.ndarray:
    """ROS's covariance, shape (6, 6), from that of the right perturbation; see above."""
    A = _ros_to_tangent(rotation)  # orthogonal, so its inverse is its transpose
    ros: np.ndarray = A.T @ covariance @ A
    return ros


def is_known(covariance: np.ndarray) -> bool:
    """Whether a covariance (6, 6) says something: not all zeros (unknown, by ROS's convention) and possible."""
    if not np.isfinite(covariance).all() or not np.any(covariance):
        return False
    return bool(np.linalg.eigvalsh((covariance + covariance.T) / 2)[0] > 0.0)
