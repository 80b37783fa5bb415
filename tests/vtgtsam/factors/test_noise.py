# SPDX-License-Identifier: MIT
import gtsam
import numpy as np
import pytest

from vtgtsam.factors.noise import (
    isotropic,
    pose_noise,
    welsch_of_each,
    welsch_of_norm,
    welsch_weight,
    welsch_weight_of_loss,
)


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
    r = np.array([0.01, -0.02, 0.005])
    noise = welsch_of_norm(isotropic(3, weight), log_theta)
    assert cost(noise, r) == pytest.approx(paper_loss(weight * r @ r, log_theta) / 2, rel=1e-12)


@pytest.mark.parametrize("log_theta", [-6.5, 0.0, -7.5])
def test_one_loss_a_row_is_the_sum_of_the_papers(log_theta):
    r = np.array([0.01, -0.02, 5.0])
    noise = welsch_of_each(isotropic(3, 2.0), log_theta)
    assert cost(noise, r) == pytest.approx(paper_loss(2 * r**2, log_theta).sum() / 2, rel=1e-12)


def test_an_outlier_silences_only_its_own_row():
    r = np.array([0.001, 50.0, 0.002])
    A = np.ones((3, 6))

    def error(factor, values, jacobians):
        if jacobians is not None:
            jacobians[0] = A
        return r

    values = gtsam.Values()
    values.insert(0, gtsam.Pose3())
    factor = gtsam.CustomFactor(welsch_of_each(isotropic(3, 1.0), -6.5), [0], error)
    rows, _ = factor.linearize(values).jacobian()
    np.testing.assert_allclose(rows[[0, 2]], A[[0, 2]], rtol=2e-3)
    np.testing.assert_allclose(rows[1], 0.0, atol=1e-12)


def test_rotation_comes_first():
    np.testing.assert_allclose(pose_noise(4.0, 100.0).sigmas(), [0.5] * 3 + [0.1] * 3)


def test_the_weight_is_the_losss_slope():
    e, step = 0.002, 1e-9
    slope = (paper_loss(e + step, -6.5) - paper_loss(e - step, -6.5)) / (2 * step)
    assert welsch_weight(e, -6.5) == pytest.approx(slope, rel=1e-6)


@pytest.mark.parametrize("e", [0.0, 1e-5, 0.002, 0.01, 1e3])
def test_the_weight_follows_from_the_loss(e):
    weight = welsch_weight_of_loss(paper_loss(e, -6.5) / 2, -6.5)
    assert weight == pytest.approx(welsch_weight(e, -6.5), abs=1e-15)
