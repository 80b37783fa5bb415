# SPDX-License-Identifier: MIT
"""How far off a robot is at all, on problems that are linear and whose errors are known."""

import numpy as np
import pytest

from vtgtsam.calibration.size import mean_over_sizes

SIZE = 18  # 6 of the camera, 12 joints
SIGMAS = np.repeat([0.01, 0.001, 0.02], [3, 3, 12])
ASSUMED = np.diag(SIGMAS**2)


def believed(rng, camera, joints):
    """True offsets of a robot off by these shares of what is assumed, and mean and covariance after its grasps."""
    true = SIGMAS * np.repeat([camera, joints], [6, 12]) * rng.choice([-1.0, 1.0], SIZE)
    A = rng.normal(size=(60, SIZE)) / SIGMAS
    y = A @ true + rng.normal(size=60)
    covariance = np.linalg.inv(np.linalg.inv(ASSUMED) + A.T @ A)
    return true, covariance @ A.T @ y, covariance


def rms(offsets):
    return np.sqrt(np.square(offsets / SIGMAS).mean())


@pytest.mark.parametrize("seed", range(4))
def test_what_grasps_say_of_an_exact_robot_is_hardly_corrected(seed):
    _, mean, covariance = believed(np.random.default_rng(seed), 0.0, 0.0)
    assert rms(mean_over_sizes(mean, covariance, ASSUMED)) < 0.6 * rms(mean)


@pytest.mark.parametrize("seed", range(4))
def test_a_robot_that_is_off_as_assumed_is_corrected_as_believed(seed):
    _, mean, covariance = believed(np.random.default_rng(seed), 1.0, 1.0)
    assert rms(mean_over_sizes(mean, covariance, ASSUMED) - mean) < 0.01 * rms(mean)


def test_a_camera_that_is_off_on_a_hand_that_is_exact_is_corrected_alone():
    _, mean, covariance = believed(np.random.default_rng(0), 1.0, 0.0)
    shrunk = mean_over_sizes(mean, covariance, ASSUMED)
    assert np.abs((shrunk - mean)[:6] / SIGMAS[:6]).max() < 0.1
    assert np.abs(shrunk[6:]).max() < 0.5 * np.abs(mean[6:]).max()


def test_robots_between_are_nearer_to_the_truth_on_average():
    rng = np.random.default_rng(5)
    before, after = [], []
    for share in (0.05, 0.1, 0.2, 0.3) * 10:
        true, mean, covariance = believed(rng, share, share)
        before.append(rms(mean - true))
        after.append(rms(mean_over_sizes(mean, covariance, ASSUMED) - true))
    assert np.mean(after) < 0.9 * np.mean(before)


def test_where_nothing_was_seen_nothing_is_said():
    np.testing.assert_allclose(mean_over_sizes(np.zeros(SIZE), ASSUMED, ASSUMED), 0.0, atol=1e-12)


def test_the_mean_is_what_a_filter_over_the_sizes_would_say():
    """One offset of the camera seen once: against the density of its sum with the noise, by hand."""
    z, noise, assumed = 2.0, 0.5, np.eye(7)
    covariance = np.eye(7)
    covariance[0, 0] = 1.0 / (1.0 + noise**-2)
    mean = np.zeros(7)
    mean[0] = z * covariance[0, 0] / noise**2
    variances = np.square([1.0, 0.3, 0.1])
    often = np.array([10.0, 1.0, 1.0])
    density = often * np.exp(-0.5 * z**2 / (variances + noise**2))
    density /= np.sqrt(variances + noise**2)
    expected = np.average(z * variances / (variances + noise**2), weights=density)
    np.testing.assert_allclose(mean_over_sizes(mean, covariance, assumed)[0], expected, rtol=1e-9)
