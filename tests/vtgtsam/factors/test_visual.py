# SPDX-License-Identifier: MIT
"""The visual term, compiled and as GTSAM's prior factor."""

import gtsam
import numpy as np
import pytest
from jacobians import assert_jacobian_matches
from reference import exp_se3, log_se3

from vtgtsam.factors.noise import gaussian, pose_noise, sqrt_information, welsch_of_norm
from vtgtsam.factors.visual import (
    ROW_JACOBIANS,
    ROWS,
    VisualTerm,
    visual_factor,
    visual_loss,
    visual_rows,
)

NOISE = pose_noise(1.0, 1.0)
HALF_TURN = gtsam.Pose3(gtsam.Rot3.RzRyRx(np.pi - 0.01, 0, 0), np.zeros(3))
SHIFT = gtsam.Pose3(gtsam.Rot3(), np.array([0.1, -0.2, 0.3]))
LOG_THETA = -1.0


def poses(count=20, seed=0):
    rng = np.random.default_rng(seed)
    return [gtsam.Pose3(exp_se3(rng.normal(0, 0.5, 6))) for _ in range(count)]


def values_at(T_wo):
    values = gtsam.Values()
    values.insert(0, T_wo)
    return values


def term_at(T_wo, T_visual, whitening, log_theta=LOG_THETA):
    """Loss, weight, rows and Jacobian of the compiled term."""
    term = VisualTerm(np.exp(log_theta))
    term.place(None if T_visual is None else T_visual.matrix(), whitening)
    loss = visual_loss(T_wo.matrix(), term.handles.table)
    weight = visual_rows(T_wo.matrix(), term.handles.table)
    return loss, weight, term.handles.arrays[ROWS], term.handles.arrays[ROW_JACOBIANS]


def test_at_the_visual_pose_nothing_pulls_and_everything_is_known():
    for T in poses():
        loss, weight, rows, J = term_at(T, T, np.eye(6))
        assert loss == pytest.approx(0, abs=1e-28) and weight == pytest.approx(1)
        np.testing.assert_allclose(rows, 0, atol=1e-14)
        np.testing.assert_allclose(J, -np.eye(6), atol=1e-14)


def test_the_residual_is_rotation_first_and_seen_from_the_estimate():
    T_wo = gtsam.Pose3(gtsam.Rot3.Rz(np.pi / 2), np.zeros(3))
    seen = T_wo.compose(gtsam.Pose3(gtsam.Rot3.Rx(0.1), np.zeros(3)))
    rows = term_at(T_wo, seen, np.eye(6), log_theta=20.0)[2]
    np.testing.assert_allclose(rows, [0.1, 0, 0, 0, 0, 0], atol=1e-9)
    moved = gtsam.Pose3(T_wo.rotation(), np.array([0.0, 0.2, 0.0]))
    rows = term_at(T_wo, moved, np.eye(6), log_theta=20.0)[2]
    np.testing.assert_allclose(rows, [0, 0, 0, 0.2, 0, 0], atol=1e-9)


def test_the_loss_is_the_papers_of_the_independent_logarithm():
    theta = np.exp(LOG_THETA)
    for T, S in zip(poses(seed=1), poses(seed=2), strict=True):
        r = log_se3(np.linalg.inv(T.matrix()) @ S.matrix()) * np.repeat([0.3, 2.0], 3)
        loss, weight, _, _ = term_at(T, S, np.diag(np.repeat([0.3, 2.0], 3)))
        assert loss == pytest.approx(theta - theta * np.exp(-r @ r / theta), rel=1e-9)
        assert weight == pytest.approx(np.exp(-r @ r / theta), rel=1e-7, abs=1e-200)


@pytest.mark.parametrize("seed", range(10))
def test_it_is_gtsams_factor_with_the_same_noise(seed):
    rng = np.random.default_rng(seed)
    T, S = poses(1, seed)[0], poses(1, seed + 100)[0]
    root = rng.normal(size=(6, 6))
    covariance = root @ root.T + 0.1 * np.eye(6)
    whitening = np.linalg.inv(np.linalg.cholesky(covariance))
    for noise, R in (
        (gaussian(covariance), whitening),
        (pose_noise(4.0, 9.0), sqrt_information(4.0, 9.0)),
    ):
        log_theta = 3.0
        factor = visual_factor(0, S, welsch_of_norm(noise, log_theta))
        loss, _, rows, J = term_at(T, S, R, log_theta)
        assert loss / 2 == pytest.approx(factor.error(values_at(T)), rel=1e-9)
        A, b = factor.linearize(values_at(T)).jacobian()
        scale = np.abs(A.T @ A).max()
        np.testing.assert_allclose(J.T @ J, A.T @ A, atol=1e-9 * scale)
        np.testing.assert_allclose(-J.T @ rows, A.T @ b, atol=1e-9 * scale)


def test_without_a_visual_pose_the_term_is_nothing():
    loss, weight, rows, J = term_at(SHIFT, None, np.eye(6))
    assert loss == weight == 0 and not rows.any() and not J.any()


@pytest.mark.parametrize("T_wo", [gtsam.Pose3(), SHIFT, HALF_TURN, *poses(10, seed=3)])
def test_the_factors_jacobian_matches_finite_differences(T_wo):
    assert_jacobian_matches(visual_factor(0, poses(1, seed=4)[0], NOISE), values_at(T_wo))


def test_the_loss_does_not_depend_on_the_world_frame():
    for G, T, S in zip(poses(seed=5), poses(seed=6), poses(seed=7), strict=True):
        moved = term_at(G.compose(T), G.compose(S), np.eye(6))[0]
        assert moved == pytest.approx(term_at(T, S, np.eye(6))[0], rel=1e-9)
