# SPDX-License-Identifier: MIT
import numpy as np
import pytest

from vtgtsam.covariance import all_held, center_ellipsoid, covariance_of, known_inverse

SCALES = np.array([0.1, 0.1, 0.1, 1.0, 1.0, 1.0])  # [m], a radian counts as a tenth of a metre


def random_information(seed):
    root = np.random.default_rng(seed).normal(size=(6, 6)) * [1, 2, 3, 100, 200, 300]
    return root.T @ root


@pytest.mark.parametrize("seed", range(5))
def test_where_all_is_measured_it_is_the_inverse(seed):
    information = random_information(seed)
    np.testing.assert_allclose(
        covariance_of(information), np.linalg.inv(information), rtol=1e-6, atol=1e-15
    )


def test_where_nothing_is_measured_every_variance_is_infinite():
    covariance = covariance_of(np.zeros((6, 6)))
    assert np.isposinf(np.diag(covariance)).all()
    assert (covariance[~np.eye(6, dtype=bool)] == 0).all()


def test_a_free_direction_has_infinite_variance_and_the_others_do_not():
    direction = np.array([0, 0, 0, 0.6, 0.8, 0])
    information = np.diag([4.0, 4, 4, 100, 100, 100])
    blind = np.eye(6) - np.outer(direction, direction)
    covariance = covariance_of(blind @ information @ blind)
    np.testing.assert_allclose(covariance[:3, :3], np.eye(3) / 4)
    assert covariance[5, 5] == pytest.approx(0.01)
    assert np.isposinf(covariance[3:5, 3:5]).all()
    assert not np.isnan(covariance).any()


def test_entries_grow_to_the_side_to_which_the_free_direction_leans():
    direction = np.array([0, 0, 0, 0.6, -0.8, 0])
    blind = np.eye(6) - np.outer(direction, direction)
    covariance = covariance_of(100.0 * blind)
    assert np.isposinf(covariance[3, 3]) and np.isneginf(covariance[3, 4])


@pytest.mark.parametrize("axis", range(6))
def test_a_direction_is_held_with_a_share_of_the_best_ones_information(axis):
    weakest = np.ones(6)
    weakest[axis] = 2e-3
    assert all_held(np.diag(weakest * SCALES**2), 1e-3)
    weakest[axis] = 0.5e-3
    assert not all_held(np.diag(weakest * SCALES**2), 1e-3)


def test_nothing_is_not_a_share_of_nothing():
    assert not all_held(np.zeros((6, 6)), 1e-3)


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("left", [1e-155, 1e-250, 1e-310])
def test_what_a_robust_loss_leaves_of_an_outlier_is_nothing_and_no_overflow(left):
    information = left * random_information(0)
    assert np.isposinf(np.diag(covariance_of(information))).all()
    assert (known_inverse(information) == 0).all()


def test_the_ellipsoid_of_a_centre_away_from_the_frame_grows_with_the_rotations_uncertainty():
    sigma_rad, sigma_m = 0.01, 1e-3
    covariance = np.diag([0, 0, sigma_rad**2, sigma_m**2, sigma_m**2, sigma_m**2])
    covariance[2, 4] = covariance[4, 2] = 0.5 * sigma_rad * sigma_m  # turn about z, shift along y
    half, axes = center_ellipsoid(np.eye(3), covariance, np.array([0.2, 0.0, 0.0]))
    # A turn about z moves the centre along y, by 2 mm a standard deviation.
    np.testing.assert_allclose(np.abs(axes[:, -1]), [0, 1, 0], atol=1e-9)
    sigmas = half / np.sqrt(7.815)
    np.testing.assert_allclose(sigmas, [1e-3, 1e-3, 1e-3 * np.sqrt(1 + 4 + 2)], rtol=1e-9)
    assert np.linalg.det(axes) == pytest.approx(1)


def test_an_infinite_covariance_has_no_ellipsoid():
    assert center_ellipsoid(np.eye(3), np.diag([1, 1, np.inf, 1, 1, 1]), np.zeros(3)) is None
