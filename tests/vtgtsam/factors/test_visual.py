# SPDX-License-Identifier: MIT
"""The visual factor: GTSAM's prior at the pose that the tracker reports."""

import gtsam
import numpy as np
import pytest
from jacobians import assert_jacobian_matches
from reference import exp_se3, log_se3

from vtgtsam.factors.noise import pose_noise, welsch_of_norm
from vtgtsam.factors.visual import visual_factor

NOISE = pose_noise(1.0, 1.0)
HALF_TURN = gtsam.Pose3(gtsam.Rot3.RzRyRx(np.pi - 0.01, 0, 0), np.zeros(3))
SHIFT = gtsam.Pose3(gtsam.Rot3(), np.array([0.1, -0.2, 0.3]))


def poses(count=20, seed=0):
    rng = np.random.default_rng(seed)
    return [gtsam.Pose3(exp_se3(rng.normal(0, 0.5, 6))) for _ in range(count)]


def values_at(T_ho):
    values = gtsam.Values()
    values.insert(0, T_ho)
    return values


def residual(T_ho, T_ho_visual):
    return visual_factor(0, T_ho_visual, NOISE).whitenedError(values_at(T_ho))


def test_at_the_visual_pose_nothing_pulls_and_everything_is_known():
    for T in poses():
        factor = visual_factor(0, T, NOISE)
        assert factor.error(values_at(T)) == pytest.approx(0, abs=1e-28)
        A, b = factor.linearize(values_at(T)).jacobian()
        np.testing.assert_allclose(A, np.eye(6), atol=1e-12)
        np.testing.assert_allclose(b, 0, atol=1e-14)


def test_the_residual_is_rotation_first_and_seen_from_the_visual_pose():
    T = gtsam.Pose3(gtsam.Rot3.Rz(np.pi / 2), np.zeros(3))
    turned = T.compose(gtsam.Pose3(gtsam.Rot3.Rx(0.1), np.zeros(3)))
    np.testing.assert_allclose(residual(turned, T), [0.1, 0, 0, 0, 0, 0], atol=1e-9)
    moved = gtsam.Pose3(T.rotation(), np.array([0.0, 0.2, 0.0]))  # along its own x
    np.testing.assert_allclose(residual(moved, T), [0, 0, 0, 0.2, 0, 0], atol=1e-9)


def test_the_residual_is_the_papers_seen_the_other_way():
    for T, S in zip(poses(seed=1), poses(seed=2), strict=True):
        paper = log_se3(np.linalg.inv(T.matrix()) @ S.matrix())
        np.testing.assert_allclose(residual(T, S), -paper, atol=1e-9)


@pytest.mark.parametrize("T_ho", [gtsam.Pose3(), SHIFT, HALF_TURN, *poses(10, seed=3)])
@pytest.mark.parametrize("T_ho_visual", [gtsam.Pose3(), *poses(1, seed=4)])
def test_the_jacobian_matches_finite_differences(T_ho, T_ho_visual):
    assert_jacobian_matches(visual_factor(0, T_ho_visual, NOISE), values_at(T_ho))


@pytest.mark.parametrize("seed", range(5))
def test_one_loss_on_the_norm_lets_go_of_all_six_together(seed):
    rng = np.random.default_rng(seed)
    T, S = poses(1, seed)[0], poses(1, seed + 100)[0]
    root = rng.normal(size=(6, 6))
    gaussian = gtsam.noiseModel.Gaussian.Covariance(root @ root.T + 0.1 * np.eye(6))
    plain = visual_factor(0, S, gaussian)
    robust = visual_factor(0, S, welsch_of_norm(gaussian, 3.0))
    e, theta = 2 * plain.error(values_at(T)), np.exp(3.0)
    expected = (theta - theta * np.exp(-e / theta)) / 2
    assert robust.error(values_at(T)) == pytest.approx(expected, rel=1e-9)
    A, b = plain.linearize(values_at(T)).jacobian()
    A_left, b_left = robust.linearize(values_at(T)).jacobian()
    np.testing.assert_allclose(A_left, np.exp(-e / theta / 2) * A, rtol=1e-9)
    np.testing.assert_allclose(b_left, np.exp(-e / theta / 2) * b, rtol=1e-9)


def test_the_error_does_not_depend_on_the_frame_of_the_poses():
    for G, T, S in zip(poses(seed=5), poses(seed=6), poses(seed=7), strict=True):
        np.testing.assert_allclose(residual(G.compose(T), G.compose(S)), residual(T, S), atol=1e-9)


def test_the_solver_comes_back_to_the_visual_pose():
    T, S = poses(1, seed=8)[0], poses(1, seed=9)[0]
    graph = gtsam.NonlinearFactorGraph()
    graph.push_back(visual_factor(0, S, NOISE))
    found = gtsam.LevenbergMarquardtOptimizer(graph, values_at(T)).optimize().atPose3(0)
    assert found.equals(S, 1e-6)
