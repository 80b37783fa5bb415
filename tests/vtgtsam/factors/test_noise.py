# SPDX-License-Identifier: MIT
"""The robust noise models are the paper's losses: the error is half the sum of rho, the weight exp(-e / theta)."""

import gtsam
import numpy as np
import pytest

from vtgtsam.factors.noise import (
    distance_noise,
    pose_noise,
    welsch_of_norm,
    welsch_of_rows,
    welsch_weight,
)

RESIDUAL = np.array([0.01, -0.02, 0.005, 0.001, 0.002, -0.003])


def paper_loss(e, log_theta):
    theta = np.exp(log_theta)
    return theta - theta * np.exp(-e / theta)


def constant(noise, residual):
    """A factor of one pose whose residual is constant and whose Jacobian is the identity."""

    def error(factor, values, jacobians):
        if jacobians is not None:
            jacobians[0] = np.eye(len(residual))
        return residual

    return gtsam.CustomFactor(noise, [0], error)


def anywhere():
    values = gtsam.Values()
    values.insert(0, gtsam.Pose3())
    return values


def weights_left(noise, residual, whitened):
    """What a noise model leaves of each row's weight, from the linearized factor."""
    A, b = constant(noise, residual).linearize(anywhere()).jacobian()
    np.testing.assert_allclose(b, -A @ residual, rtol=1e-12)
    return (A.diagonal() * residual / whitened) ** 2


@pytest.mark.parametrize("log_theta", [-6.5, 0.0, -7.5, 5.0])
@pytest.mark.parametrize("weight", [1.0, 0.01, 30.0])
def test_one_loss_on_the_norm_is_the_papers(log_theta, weight):
    noise = welsch_of_norm(pose_noise(weight, weight), log_theta)
    e = weight * RESIDUAL @ RESIDUAL
    error = constant(noise, RESIDUAL).error(anywhere())
    assert error == pytest.approx(paper_loss(e, log_theta) / 2, rel=1e-12)
    left = weights_left(noise, RESIDUAL, np.sqrt(weight) * RESIDUAL)
    np.testing.assert_allclose(left, np.exp(-e / np.exp(log_theta)), rtol=1e-9)


@pytest.mark.parametrize("log_theta", [-6.5, 0.0, -12.0, 3.4])
@pytest.mark.parametrize("weight", [1.0, 0.01, 30.0])
def test_a_loss_on_each_row_is_the_papers_of_each_pad(log_theta, weight):
    noise = welsch_of_rows(distance_noise(6, weight), log_theta)
    e = weight * RESIDUAL**2
    error = constant(noise, RESIDUAL).error(anywhere())
    assert error == pytest.approx(paper_loss(e, log_theta).sum() / 2, rel=1e-12)
    left = weights_left(noise, RESIDUAL, np.sqrt(weight) * RESIDUAL)
    np.testing.assert_allclose(left, np.exp(-e / np.exp(log_theta)), rtol=1e-9)


def test_rotation_comes_first():
    np.testing.assert_allclose(pose_noise(4.0, 100.0).sigmas(), [0.5] * 3 + [0.1] * 3)


def test_a_weight_is_one_over_sigma_squared():
    np.testing.assert_allclose(distance_noise(3, 100.0).sigmas(), [0.1] * 3)


def test_the_weight_is_the_losss_slope():
    e, step = 0.002, 1e-9
    slope = (paper_loss(e + step, -6.5) - paper_loss(e - step, -6.5)) / (2 * step)
    assert welsch_weight(e, -6.5) == pytest.approx(slope, rel=1e-6)
