# SPDX-License-Identifier: MIT
import gtsam
import numpy as np
import pytest
from jacobians import assert_jacobian_matches
from reference import exp_se3, log_se3

from vtgtsam.factors.noise import pose_noise
from vtgtsam.factors.visual import visual_factor, visual_residual

NOISE = pose_noise(1.0, 1.0)
HALF_TURN = gtsam.Pose3(gtsam.Rot3.RzRyRx(np.pi - 0.01, 0, 0), np.zeros(3))
SHIFT = gtsam.Pose3(gtsam.Rot3(), np.array([0.1, -0.2, 0.3]))


def poses(count=20, seed=0):
    rng = np.random.default_rng(seed)
    return [gtsam.Pose3(exp_se3(rng.normal(0, 0.5, 6))) for _ in range(count)]


def values_at(T_wo):
    values = gtsam.Values()
    values.insert(0, T_wo)
    return values


def test_no_residual_at_the_visual_pose():
    for T in poses():
        np.testing.assert_allclose(visual_residual(T, T), 0, atol=1e-12)
        assert visual_factor(0, T, NOISE).error(values_at(T)) == pytest.approx(0, abs=1e-20)


def test_the_residual_is_rotation_first_and_seen_from_the_estimate():
    T_wo = gtsam.Pose3(gtsam.Rot3.Rz(np.pi / 2), np.zeros(3))
    seen = T_wo.compose(gtsam.Pose3(gtsam.Rot3.Rx(0.1), np.zeros(3)))
    np.testing.assert_allclose(visual_residual(T_wo, seen), [0.1, 0, 0, 0, 0, 0], atol=1e-12)
    moved = gtsam.Pose3(T_wo.rotation(), np.array([0.0, 0.2, 0.0]))
    np.testing.assert_allclose(visual_residual(T_wo, moved), [0, 0, 0, 0.2, 0, 0], atol=1e-12)


def test_the_residual_is_the_independent_logarithm():
    for T, S in zip(poses(seed=1), poses(seed=2), strict=True):
        expected = log_se3(np.linalg.inv(T.matrix()) @ S.matrix())
        np.testing.assert_allclose(visual_residual(T, S), expected, atol=1e-9)


def test_the_factor_has_the_residuals_cost():
    for T, S in zip(poses(seed=1), poses(seed=2), strict=True):
        r = visual_residual(T, S)
        assert visual_factor(0, S, NOISE).error(values_at(T)) == pytest.approx(r @ r / 2)


@pytest.mark.parametrize("T_wo", [gtsam.Pose3(), SHIFT, HALF_TURN, *poses(10, seed=3)])
def test_the_jacobian_matches_finite_differences(T_wo):
    assert_jacobian_matches(visual_factor(0, poses(1, seed=4)[0], NOISE), values_at(T_wo))


def test_the_residual_does_not_depend_on_the_world_frame():
    for G, T, S in zip(poses(seed=5), poses(seed=6), poses(seed=7), strict=True):
        moved = visual_residual(G.compose(T), G.compose(S))
        np.testing.assert_allclose(moved, visual_residual(T, S), atol=1e-9)
