# SPDX-License-Identifier: MIT
r"""Visual factor of an uncalibrated camera: the pose that a tracker reports, and where its camera really is.

The camera's error is a twist e in the world's axes about a point c: what the tracker reports is

    T_wo_visual = C(e) T_wh T_ho,    C(e) = Trans(c) Exp(e) Trans(-c),

up to its own noise. The residual is the twist from the reported pose to that one,

    r(T_ho, e) = Log(T_wo_visual^-1 C(e) T_wh T_ho),    rotation [rad] first, then translation [m].

With J_r the right Jacobian of Exp, a right perturbation of T_ho changes it by J_r^-1(r), and one of e, which is a right
perturbation J_r(e) of Exp(e), by

    dr/de = J_r^-1(r) Ad((Trans(-c) T_wh T_ho)^-1) J_r(e).

With e = 0 known, this is ``visual``'s.
"""

from __future__ import annotations

import gtsam
import numpy as np

from .checked import POSE3_DIMENSION, checked_factor


def seen_residual(
    T_ho: gtsam.Pose3,
    camera: np.ndarray,
    T_wh: gtsam.Pose3,
    T_wo_visual: gtsam.Pose3,
    camera_origin: np.ndarray,
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The residual, shape (6,), and its Jacobians with respect to T_ho and to the camera's twist, shape (6, 6).

    Args:
        T_ho: Pose of the object in the hand.
        camera: The camera's twist e, shape (6,), rotation [rad] first, then translation [m].
        T_wh: Pose of the hand in the world.
        T_wo_visual: The reported pose.
        camera_origin: The point c that the twist turns about, in the world [m], shape (3,).
    """
    T_co = T_wh.compose(T_ho)
    T_co = gtsam.Pose3(T_co.rotation(), T_co.translation() - camera_origin)
    seen = gtsam.Pose3.Expmap(camera).compose(T_co)
    seen = gtsam.Pose3(seen.rotation(), seen.translation() + camera_origin)
    difference = T_wo_visual.between(seen)
    of_pose = gtsam.Pose3.LogmapDerivative(difference)
    of_camera = of_pose @ T_co.inverse().AdjointMap() @ gtsam.Pose3.ExpmapDerivative(camera)
    return gtsam.Pose3.Logmap(difference), of_pose, of_camera


def seen_factor(
    key: int,
    camera_key: int,
    T_wh: gtsam.Pose3,
    T_wo_visual: gtsam.Pose3,
    camera_origin: np.ndarray,
    noise: gtsam.noiseModel.Base,
) -> gtsam.CustomFactor:
    """Hold the object where the tracker reports it, as far as its camera is where it is believed to be.

    Args:
        key: Key of the object's pose T_ho.
        camera_key: Key of the camera's twist e, a vector of dimension 6.
        T_wh: Pose of the hand in the world.
        T_wo_visual: The reported pose.
        camera_origin: The point that the twist turns about, in the world [m], shape (3,).
        noise: Noise model of dimension 6, rotation [rad] first, then translation [m].
    """

    def error(
        factor: gtsam.CustomFactor, values: gtsam.Values, jacobians: list[np.ndarray] | None
    ) -> np.ndarray:
        T_ho, camera = values.atPose3(key), values.atVector(camera_key)
        residual, of_pose, of_camera = seen_residual(T_ho, camera, T_wh, T_wo_visual, camera_origin)
        if jacobians is not None:
            jacobians[0], jacobians[1] = of_pose, of_camera
        return residual

    return checked_factor(noise, [key, camera_key], error, [POSE3_DIMENSION, POSE3_DIMENSION])
