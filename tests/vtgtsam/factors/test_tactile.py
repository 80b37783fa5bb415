# SPDX-License-Identifier: MIT
"""The tactile factor: the surface is pulled onto the pads that report contact."""

import gtsam
import numpy as np
import pytest
from hand_frames import RADIUS, VOXEL, facing_pad, pads_about, smooth_frames, values_at
from jacobians import assert_jacobian_matches
from problems import ball_sdf, pads_around, random_pose

from vtgtsam.factors.noise import distance_noise, welsch_of_rows
from vtgtsam.factors.pad_distances import PadDistances
from vtgtsam.factors.tactile import tactile_factor, tactile_jacobian, tactile_residual
from vtgtsam.sdf.search import ClosestPoints

ONE = distance_noise(1, 1.0)
HERE = values_at(gtsam.Pose3())


def test_a_gap_is_the_residual_and_a_penetration_is_none():
    np.testing.assert_array_equal(tactile_residual(np.array([0.004, -0.002, 0.0])), [0.004, 0, 0])


def test_the_factor_pulls_over_a_gap_and_leaves_a_penetration_alone():
    gap = tactile_factor(0, facing_pad(0.004), ONE)
    assert gap.whitenedError(HERE)[0] == pytest.approx(0.004, abs=VOXEL**2 / RADIUS)
    inside = tactile_factor(0, facing_pad(-0.004), ONE)
    assert inside.error(HERE) == 0.0 and not inside.linearize(HERE).jacobian()[0].any()


def test_moving_the_object_towards_the_pad_closes_the_gap():
    J, _ = tactile_factor(0, facing_pad(0.004), ONE).linearize(HERE).jacobian()
    np.testing.assert_allclose(J[0, 5], -1, atol=0.01)  # the object's +z is towards the pad
    np.testing.assert_allclose(J[0, 3:5], 0, atol=0.05)


def test_only_the_pads_that_touch_have_a_row():
    touching = np.arange(8) % 3 == 0
    pads = pads_about(1, distance=0.04, touching=touching)
    distances = pads.everywhere(gtsam.Pose3()).distances
    factor = tactile_factor(0, pads, distance_noise(touching.sum(), 1.0))
    np.testing.assert_allclose(factor.whitenedError(HERE), distances[touching], atol=1e-12)
    assert (distances > 0).all()


def test_jacobians_match_finite_differences():
    active = 0
    for pads, T_ho in smooth_frames(distance=RADIUS + 0.003):
        factor = tactile_factor(0, pads, distance_noise(2, 4.0))
        active += np.count_nonzero(factor.whitenedError(values_at(T_ho)))
        # 1e-7: short of the next grid point becoming the closest
        assert_jacobian_matches(factor, values_at(T_ho), step=1e-7, atol=1e-5)
    assert active >= 10


def test_the_jacobian_is_none_where_the_pad_is_inside():
    J = np.arange(12.0).reshape(2, 6) + 1
    np.testing.assert_array_equal(tactile_jacobian(np.array([0.1, -0.1]), J), [J[0], np.zeros(6)])


@pytest.mark.parametrize("log_theta", [-12.0, -9.0, 0.0])
def test_each_row_has_the_papers_loss_and_the_weight_it_leaves(log_theta):
    theta, weight = np.exp(log_theta), 3.0
    pads = pads_about(8, count=10)
    plain = tactile_factor(0, pads, distance_noise(10, weight))
    noise = welsch_of_rows(distance_noise(10, weight), log_theta)
    robust = tactile_factor(0, pads, noise)
    e = plain.whitenedError(HERE) ** 2
    assert (e > 0).sum() >= 4
    expected = (theta - theta * np.exp(-e / theta)).sum() / 2
    assert robust.error(HERE) == pytest.approx(expected, rel=1e-9)
    J, b = plain.linearize(HERE).jacobian()
    J_left, b_left = robust.linearize(HERE).jacobian()
    root = np.exp(-e / theta / 2)
    np.testing.assert_allclose(J_left, root[:, None] * J, rtol=1e-9, atol=1e-15)
    np.testing.assert_allclose(b_left, root * b, rtol=1e-9, atol=1e-15)


def test_an_outlier_silences_only_its_own_row():
    pads, T_hp = pads_around(2, count=3, distance=RADIUS)
    T_hp[:, :3, 3] *= 0.032 / np.linalg.norm(T_hp[:, :3, 3], axis=1)[:, None]
    T_hp[1, :3, 3] *= 5.0
    closest = ClosestPoints(pads, ball_sdf(RADIUS, 64))
    frame = PadDistances(closest, T_hp, np.ones(3, bool))
    factor = tactile_factor(0, frame, welsch_of_rows(distance_noise(3, 1.0), np.log(1e-5)))
    norms = np.linalg.norm(factor.linearize(HERE).jacobian()[0], axis=1)
    assert norms[1] < 1e-12 < 0.5 < norms[0]


def test_the_residual_does_not_depend_on_the_frame_of_the_poses():
    rng = np.random.default_rng(3)
    pads, T_hp = pads_around(3)
    closest = ClosestPoints(pads, ball_sdf())
    T_ho, G, every = random_pose(rng), random_pose(rng, 1.0, 0.5), np.ones(8, bool)
    here = tactile_factor(0, PadDistances(closest, T_hp, every), distance_noise(8, 1.0))
    there = tactile_factor(0, PadDistances(closest, G @ T_hp, every), distance_noise(8, 1.0))
    np.testing.assert_allclose(
        there.whitenedError(values_at(gtsam.Pose3(G @ T_ho))),
        here.whitenedError(values_at(gtsam.Pose3(T_ho))),
        atol=1e-12,
    )


def test_contact_pulls_a_ball_back_onto_the_pads_and_the_error_falls_each_step():
    pads, T_hp = pads_around(6, count=10, distance=RADIUS)
    T_hp[:, :3, 3] *= RADIUS / np.linalg.norm(T_hp[:, :3, 3], axis=1)[:, None]
    closest = ClosestPoints(pads, ball_sdf(RADIUS, 64))
    frame = PadDistances(closest, T_hp, np.ones(10, bool))
    graph = gtsam.NonlinearFactorGraph()
    graph.push_back(tactile_factor(0, frame, distance_noise(10, 1.0)))
    start = values_at(gtsam.Pose3(gtsam.Rot3(), np.array([0.004, -0.003, 0.002])))
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setRelativeErrorTol(0)
    parameters.setAbsoluteErrorTol(0)
    optimizer = gtsam.LevenbergMarquardtOptimizer(graph, start, parameters)
    errors = [graph.error(start)]
    for _ in range(5):
        optimizer.iterate()
        errors.append(optimizer.error())
    assert (np.diff(errors) <= 0).all() and errors[-1] < errors[0] / 50


def test_a_noise_model_of_another_size_is_refused_when_it_is_evaluated():
    with pytest.raises(Exception, match=r"shape \(3,\).*got shape \(8,\)"):
        tactile_factor(0, pads_about(1), distance_noise(3, 1.0)).error(HERE)
