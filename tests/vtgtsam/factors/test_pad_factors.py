# SPDX-License-Identifier: MIT
"""Tactile and penetration factors, which share one search for the closest points."""

import gtsam
import numpy as np
import pytest
from jacobians import assert_jacobian_matches
from problems import ball_sdf, box_sdf, lump_sdf, pads_around, random_pose
from reference import Problem

from vtgtsam import Pad, PadSet
from vtgtsam.factors.noise import isotropic
from vtgtsam.factors.penetration import penetration_factor, penetration_residual
from vtgtsam.factors.tactile import tactile_factor, tactile_residual
from vtgtsam.sdf.closest import ClosestPoints

RADIUS = 0.03


def facing_pad(gap):
    """One pad above the ball's top, ``gap`` away from it, facing down."""
    T_wp = np.diag([1.0, -1.0, -1.0, 1.0])
    T_wp[2, 3] = RADIUS + gap
    closest = ClosestPoints(PadSet([Pad("pad", (0.014, 0.018))]), ball_sdf(RADIUS, 64))
    closest.place(T_wp[None])
    return closest


def values_at(T_wo):
    values = gtsam.Values()
    values.insert(0, T_wo)
    return values


def test_a_gap_pulls_and_a_penetration_pushes():
    voxel = 0.12 / 63
    gap = facing_pad(0.004).at(gtsam.Pose3())
    depth = facing_pad(-0.004).at(gtsam.Pose3())
    touching = np.array([0])
    assert tactile_residual(gap.distances, gap.jacobians, touching)[0] == pytest.approx(
        0.004, abs=voxel**2 / RADIUS
    )
    assert penetration_residual(gap.distances, gap.jacobians)[0] == 0
    assert tactile_residual(depth.distances, depth.jacobians, touching)[0] == 0
    assert penetration_residual(depth.distances, depth.jacobians)[0] == pytest.approx(
        -0.004, abs=voxel**2 / RADIUS
    )


def test_moving_the_object_towards_the_pad_closes_the_gap():
    gap = facing_pad(0.004).at(gtsam.Pose3())
    _, J = tactile_residual(gap.distances, gap.jacobians, np.array([0]))
    np.testing.assert_allclose(J[0, 5], -1, atol=0.01)  # the object's +z is towards the pad
    np.testing.assert_allclose(J[0, 3:5], 0, atol=0.05)


def test_rows_without_residual_have_no_jacobian():
    depth, gap = facing_pad(-0.004).at(gtsam.Pose3()), facing_pad(0.004).at(gtsam.Pose3())
    _, J_tac = tactile_residual(depth.distances, depth.jacobians, np.array([0]))
    _, J_pen = penetration_residual(gap.distances, gap.jacobians)
    assert not J_tac.any() and not J_pen.any()


@pytest.mark.parametrize("seed", range(12))
def test_closest_points_agree_with_an_independent_search(seed):
    rng = np.random.default_rng(seed)
    sdf = [lump_sdf(seed), box_sdf(), ball_sdf()][seed % 3]
    pads, T_wp = pads_around(seed, count=6, distance=rng.uniform(0.02, 0.08))
    T_wo = random_pose(rng, 1.0, 0.01)
    T_wp = random_pose(rng, 2.0, 0.02) @ T_wp  # some pads end beyond the grid
    problem = Problem(
        sdf.values, sdf.lower, sdf.upper, [p.points_p for p in pads.pads], T_wp, None, None
    )
    phi, J, _ = problem.closest(T_wo)
    closest = ClosestPoints(pads, sdf)
    closest.place(T_wp)
    found = closest.at(gtsam.Pose3(T_wo))
    np.testing.assert_allclose(found.distances, phi, atol=1e-12)
    np.testing.assert_allclose(found.jacobians, J, atol=1e-9)


def well_inside_a_cell(closest, T_wo, pads, T_wp, sdf, margin=0.02):
    """Whether no closest point is within ``margin`` cells of a kink of the trilinear value."""
    points_w = closest.points_w(closest.at(T_wo))
    points_o = np.array([T_wo.transformTo(p) for p in points_w])
    place = (points_o - sdf.lower) * sdf.scale % 1.0
    return np.minimum(place, 1 - place).min() > margin


@pytest.mark.parametrize("gap", [-0.003, 0.003])
def test_jacobians_match_finite_differences(gap):
    checked = 0
    for seed in range(60):
        rng = np.random.default_rng(seed)
        sdf = lump_sdf(seed)
        pads, T_wp = pads_around(seed, count=2, distance=RADIUS + gap)
        closest = ClosestPoints(pads, sdf)
        closest.place(T_wp)
        T_wo = gtsam.Pose3(random_pose(rng, 0.3, 0.001))
        if not well_inside_a_cell(closest, T_wo, pads, T_wp, sdf):
            continue
        checked += 1
        noise = isotropic(2, 4.0)
        # 1e-7: short of the next grid point becoming the closest
        for factor in (
            tactile_factor(0, np.array([0, 1]), closest, noise),
            penetration_factor(0, closest, noise),
        ):
            assert_jacobian_matches(factor, values_at(T_wo), step=1e-7, atol=1e-5)
    assert checked >= 10


def test_residuals_do_not_depend_on_the_world_frame():
    rng = np.random.default_rng(3)
    sdf = lump_sdf(3)
    pads, T_wp = pads_around(3)
    T_wo, G = random_pose(rng), random_pose(rng, 1.0, 0.5)
    closest = ClosestPoints(pads, sdf)
    closest.place(T_wp)
    here = closest.at(gtsam.Pose3(T_wo))
    closest.place(G @ T_wp)
    there = closest.at(gtsam.Pose3(G @ T_wo))
    np.testing.assert_allclose(there.distances, here.distances, atol=1e-12)


def test_the_order_of_the_pads_does_not_matter():
    pads, T_wp = pads_around(4)
    order = np.random.default_rng(4).permutation(len(pads))
    closest = ClosestPoints(pads, lump_sdf(4))
    closest.place(T_wp)
    shuffled = ClosestPoints(PadSet(pads.pads[k] for k in order), lump_sdf(4))
    shuffled.place(T_wp[order])
    T_wo = gtsam.Pose3()
    np.testing.assert_array_equal(shuffled.at(T_wo).distances, closest.at(T_wo).distances[order])


def test_placing_the_pads_anew_forgets_the_last_pose():
    pads, T_wp = pads_around(5)
    closest = ClosestPoints(pads, lump_sdf(5))
    closest.place(T_wp)
    before = closest.at(gtsam.Pose3()).distances
    T_wp = T_wp.copy()
    T_wp[:, :3, 3] *= 1.2
    closest.place(T_wp)
    assert (closest.at(gtsam.Pose3()).distances > before).all()


def test_contact_pulls_a_ball_back_onto_the_pads_and_the_error_falls_each_step():
    pads, T_wp = pads_around(6, count=10, distance=RADIUS)
    T_wp[:, :3, 3] *= RADIUS / np.linalg.norm(T_wp[:, :3, 3], axis=1)[:, None]
    closest = ClosestPoints(pads, ball_sdf(RADIUS, 64))
    closest.place(T_wp)
    graph = gtsam.NonlinearFactorGraph()
    graph.push_back(tactile_factor(0, np.arange(10), closest, isotropic(10, 1.0)))
    graph.push_back(penetration_factor(0, closest, isotropic(10, 1.0)))
    values = values_at(gtsam.Pose3(gtsam.Rot3(), np.array([0.004, -0.003, 0.002])))
    errors = [graph.error(values)]
    parameters = gtsam.LevenbergMarquardtParams()
    parameters.setRelativeErrorTol(0)
    parameters.setAbsoluteErrorTol(0)
    optimizer = gtsam.LevenbergMarquardtOptimizer(graph, values, parameters)
    for _ in range(5):
        optimizer.iterate()
        errors.append(optimizer.error())
    assert (np.diff(errors) <= 0).all() and errors[-1] < errors[0] / 50
    # The grid's own error at the ball's surface: voxel^2 / (2 radius)
    assert np.linalg.norm(optimizer.values().atPose3(0).translation()) < 2e-4
