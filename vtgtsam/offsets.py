# SPDX-License-Identifier: MIT
r"""What an imperfectly calibrated robot believes wrongly: where its camera is, and where its joints are zero.

The offsets c = (e, dq) stay the same from frame to frame and are not estimated here; what is known of them is a prior,
c ~ N(0, P). They enter a frame in two places (conventions of ``Calibration``):

- the camera reports T_wo_visual = Exp(e) T_wo, e a twist in the world's axes about ``camera_origin``. To first order
  the visual pose is off by the right perturbation A e, with A = Ad(T_wo^-1 Trans(camera_origin));
- the hand's joints are at q - dq, and a pad's signed distance is phi + G dq, with G_kj = dphi_k / d dq_j.

``CalibrationPrior`` holds P; ``knowledge`` says what the offsets leave uncertain of an estimate.
"""

from __future__ import annotations

import gtsam
import numpy as np

from .config import EstimatorConfig

CAMERA = 6  # the camera's offsets are the first six


class CalibrationPrior:
    """What is known of a robot's offsets.

    Args:
        covariance: P, of the camera's six first, then of the joints' zeros, shape (6 + J, 6 + J).
        camera_origin: Where the camera's twist turns about, in the world [m], shape (3,).

    Attributes:
        covariance: As given.
        apart: The same without correlations between camera and joints, shape (6 + J, 6 + J): with so much a frame's
            factors weigh vision and touch, each by itself.
        camera_origin: As given.
    """

    def __init__(self, covariance: np.ndarray, camera_origin: np.ndarray) -> None:
        self.covariance = covariance
        self.apart = covariance.copy()
        self.apart[:CAMERA, CAMERA:] = self.apart[CAMERA:, :CAMERA] = 0.0
        self.camera_origin = camera_origin
        self.camera_uncertain = bool(covariance[:CAMERA, :CAMERA].any())
        self.joints_uncertain = bool(covariance[CAMERA:, CAMERA:].any())
        self._joint_noise: gtsam.noiseModel.Base | None = None

    @classmethod
    def of_config(
        cls, config: EstimatorConfig, zero_units: np.ndarray, camera_origin: np.ndarray
    ) -> CalibrationPrior:
        """The prior that a configuration's sigmas say of a robot.

        Args:
            config: The sigmas.
            zero_units: ``HandModel.zero_units``, shape (J,); empty where joints are not known.
            camera_origin: Where the camera's twist turns about, in the world [m], shape (3,).
        """
        of_camera = np.repeat(config.camera_sigma, 3)
        sigmas = np.concatenate([of_camera, config.joint_sigma * zero_units])
        return cls(np.diag(np.square(sigmas)), camera_origin)

    def camera_jacobian(self, T_wo: gtsam.Pose3) -> np.ndarray:
        """A, shape (6, 6): by which right perturbation of T_wo the camera's twist moves a visual pose."""
        about = gtsam.Pose3(gtsam.Rot3(), self.camera_origin)
        jacobian: np.ndarray = T_wo.inverse().compose(about).AdjointMap()
        return jacobian

    def camera_share(self, T_wo: gtsam.Pose3) -> np.ndarray:
        """The camera's part of a visual pose's covariance, shape (6, 6)."""
        A = self.camera_jacobian(T_wo)
        share: np.ndarray = A @ self.covariance[:CAMERA, :CAMERA] @ A.T
        return share

    def joint_noise(self) -> gtsam.noiseModel.Base:
        """Of the joints' zeros, dimension J."""
        if self._joint_noise is None:
            zeros = self.covariance[CAMERA:, CAMERA:]
            self._joint_noise = gtsam.noiseModel.Gaussian.Covariance(zeros)
        return self._joint_noise
