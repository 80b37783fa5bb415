# SPDX-License-Identifier: MIT
import gtsam
import numpy as np
import pytest

from vtgtsam.factors.noise import pose_noise, sqrt_information, theta, welsch_of_norm, welsch_weight


def paper_loss(e, log_theta):
    theta = np.exp(log_theta)
    return theta - theta * np.exp(-e / theta)


def cost(noise, residual):
    """What GTSAM makes of a constant residual."""

    def error(factor, values, jacobians):
        return residual

    return gtsam.CustomFactor(noise, [0], error).error(gtsam.Values())


@pytest.mark.parametrize("log_theta", [-6.5, 0.0, -7.5])
@pytest.mark.parametrize("weight", [1.0, 0.01, 30.0])
def test_one_loss_on_the_norm_is_the_papers(log_theta, weight):
    r = np.array([0.01, -0.02, 0.005, 0.001, 0.002, -0.003])
    noise = welsch_of_norm(pose_noise(weight, weight), log_theta)
    assert cost(noise, r) == pytest.approx(paper_loss(weight * r @ r, log_theta) / 2, rel=1e-12)


def test_rotation_comes_first():
    np.testing.assert_allclose(pose_noise(4.0, 100.0).sigmas(), [0.5] * 3 + [0.1] * 3)


def test_the_square_root_of_the_information_whitens_as_the_noise_model_does():
    r = np.arange(1.0, 7.0)
    np.testing.assert_allclose(sqrt_information(4.0, 100.0) @ r, pose_noise(4.0, 100.0).whiten(r))


def test_theta_is_what_the_settings_have_the_logarithm_of():
    assert theta(-6.5) == pytest.approx(np.exp(-6.5))


def test_the_weight_is_the_losss_slope():
    e, step = 0.002, 1e-9
    slope = (paper_loss(e + step, -6.5) - paper_loss(e - step, -6.5)) / (2 * step)
    assert welsch_weight(e, -6.5) == pytest.approx(slope, rel=1e-6)
