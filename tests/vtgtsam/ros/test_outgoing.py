# SPDX-License-Identifier: MIT
from __future__ import annotations

import gtsam
import numpy as np

from vtgtsam.recording.covariance import tangent_from_ros
from vtgtsam.ros.outgoing import UNKNOWN, ros_covariance

T = gtsam.Pose3(gtsam.Rot3.Rz(np.pi / 2), np.array([0.1, 0.2, 0.3]))


def test_a_covariance_has_ros_order_and_fixed_axes():
    tangent = np.diag([1e-4, 2e-4, 3e-4, 1e-6, 4e-6, 9e-6])
    ros = np.array(ros_covariance(tangent, T)).reshape(6, 6)
    np.testing.assert_allclose(np.diag(ros), [4e-6, 1e-6, 9e-6, 2e-4, 1e-4, 3e-4], atol=1e-12)
    np.testing.assert_allclose(tangent_from_ros(ros, T.rotation()), tangent, atol=1e-12)


def test_what_nothing_measures_is_a_large_number():
    covariance = np.diag([1e-4, 1e-4, np.inf, 1e-6, 1e-6, 1e-6])
    ros = np.array(ros_covariance(covariance, T)).reshape(6, 6)
    assert np.isfinite(ros).all()
    assert ros[5, 5] == UNKNOWN
