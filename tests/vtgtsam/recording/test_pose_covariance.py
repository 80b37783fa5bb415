# SPDX-License-Identifier: MIT
import gtsam
import numpy as np

from vtgtsam.recording.covariance import is_known, ros_from_tangent, tangent_from_ros


def random_covariance(rng):
    root = rng.normal(size=(6, 6))
    return root @ root.T


def test_there_and_back_changes_nothing():
    rng = np.random.default_rng(0)
    covariance, rotation = random_covariance(rng), gtsam.Rot3.RzRyRx(*rng.normal(size=3))
    back = ros_from_tangent(tangent_from_ros(covariance, rotation), rotation)
    np.testing.assert_allclose(back, covariance, atol=1e-12)


def test_it_is_the_spread_of_poses_perturbed_as_ros_says():
    rng = np.random.default_rng(1)
    T = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.4, -1.1, 2.0), rng.normal(size=3))
    ros = random_covariance(rng) * 1e-8  # small, so that first order is all there is
    tangent = []
    for dt_dw in rng.multivariate_normal(np.zeros(6), ros, size=20000):
        rotation = gtsam.Rot3.Expmap(dt_dw[3:]) * T.rotation()  # about the fixed axes
        perturbed = gtsam.Pose3(rotation, T.translation() + dt_dw[:3])
        tangent.append(gtsam.Pose3.Logmap(T.between(perturbed)))
    expected = tangent_from_ros(ros, T.rotation())
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    # Of 20,000 samples a correlation is known to about 1 / sqrt(20000) = 0.007.
    np.testing.assert_allclose(np.cov(np.array(tangent).T) / scale, expected / scale, atol=0.04)


def test_a_covariance_that_says_nothing_is_not_known():
    assert is_known(np.diag([0.04] * 3 + [0.0025] * 3))
    assert not is_known(np.zeros((6, 6)))
    assert not is_known(np.diag([-1.0] * 6))
    assert not is_known(np.full((6, 6), np.nan))
