# SPDX-License-Identifier: MIT
"""Exponential, logarithm and Jacobian are GTSAM's, at every angle."""

import gtsam
import numpy as np
import pytest

from vtgtsam.se3 import inverse_left_jacobian, log_between, retract

ANGLES = [0.0, 1e-12, 1e-8, 1e-5, 1e-3, 0.03, 0.49999, 0.50001, 1.0, 2.0, 2.6, 2.7, 3.0, 3.1]
HALF_TURNS = [np.pi - 1e-3, np.pi - 1e-6, np.pi - 1e-9, np.pi]


def twists(angle, count=20):
    rng = np.random.default_rng(int(1e6 * angle))
    for n in range(count):
        axis = np.eye(3)[n] if n < 3 else rng.normal(size=3)
        yield np.concatenate(
            [angle * axis / np.linalg.norm(axis), rng.normal(0, 10.0 ** rng.uniform(-6, 0), 3)]
        )


def poses(count=20, seed=0):
    rng = np.random.default_rng(seed)
    return [gtsam.Pose3.Expmap(rng.normal(size=6)) for _ in range(count)]


@pytest.mark.parametrize("angle", ANGLES + HALF_TURNS)
def test_a_retraction_is_gtsams(angle):
    for T, xi in zip(poses(), twists(angle), strict=True):
        moved = np.empty((4, 4))
        retract(T.matrix(), xi, moved)
        np.testing.assert_allclose(moved, T.retract(xi).matrix(), atol=2e-15)


@pytest.mark.parametrize("angle", ANGLES)
def test_the_logarithm_is_gtsams(angle):
    for T, xi in zip(poses(), twists(angle), strict=True):
        S, r = T.retract(xi), np.empty(6)
        log_between(T.matrix(), S.matrix(), r)
        np.testing.assert_allclose(r, gtsam.Pose3.Logmap(T.between(S)), atol=1e-13)
        np.testing.assert_allclose(r, xi, atol=1e-13)


@pytest.mark.parametrize("angle", HALF_TURNS)
def test_half_a_turn_comes_back_to_the_same_pose(angle):
    for T, xi in zip(poses(), twists(angle), strict=True):
        S, r, back = T.retract(xi), np.empty(6), np.empty((4, 4))
        log_between(T.matrix(), S.matrix(), r)
        retract(T.matrix(), r, back)
        np.testing.assert_allclose(back, S.matrix(), atol=1e-14)
        assert np.linalg.norm(r[:3]) <= np.pi + 1e-15


@pytest.mark.parametrize("angle", ANGLES)
def test_the_jacobian_is_that_of_gtsams_prior(angle):
    for T, xi in zip(poses(), twists(angle), strict=True):
        factor = gtsam.PriorFactorPose3(0, T.retract(xi), gtsam.noiseModel.Unit.Create(6))
        values = gtsam.Values()
        values.insert(0, T)
        expected, _ = factor.linearize(values).jacobian()
        J = np.empty((6, 6))
        inverse_left_jacobian(xi, J)
        # GTSAM's own closed forms lose digits at small angles
        np.testing.assert_allclose(J, expected, atol=1e-12 * max(1, np.abs(expected).max()))
