# SPDX-License-Identifier: MIT
"""The tactile and the penetration term of all pads, and the factor that holds them."""

import gtsam
import numpy as np
import pytest
from problems import ball_sdf, box_sdf, lump_sdf, pads_around, random_pose
from reference import Problem

from vtgtsam import Pad, PadSet
from vtgtsam.exceptions import FactorError
from vtgtsam.factors.hand import HandTerms, HandWeights, hand_factor, terms_at
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


def terms_of(closest, touching, tactile=1.0, penetration=1.0, theta=1e3):
    """The hand's terms, with a loss that hardly bends where none is given."""
    terms = HandTerms(closest, HandWeights(tactile, penetration, theta))
    terms.place(closest.T_wp.copy(), np.asarray(touching, dtype=bool))
    return terms


def fill(terms, T_wo):
    return terms_at(T_wo.matrix(), terms.handles.table, terms.closest.search.table)


def test_a_gap_pulls_and_a_penetration_pushes():
    voxel = 0.12 / 63
    for distance in (0.004, -0.004):
        terms = terms_of(facing_pad(distance), [True])
        assert fill(terms, gtsam.Pose3())
        assert terms.rows[0] == pytest.approx(distance, abs=voxel**2 / RADIUS)
        assert terms.losses[0] == pytest.approx(abs(terms.rows[0]), rel=1e-6)


def test_a_pad_without_contact_does_not_pull_but_pushes():
    gap, depth = terms_of(facing_pad(0.004), [False]), terms_of(facing_pad(-0.004), [False])
    assert fill(gap, gtsam.Pose3()) and fill(depth, gtsam.Pose3())
    assert not gap.rows.any() and not gap.jacobians.any() and not gap.losses.any()
    assert depth.rows[0] < -0.0039


def test_moving_the_object_towards_the_pad_closes_the_gap():
    terms = terms_of(facing_pad(0.004), [True])
    fill(terms, gtsam.Pose3())
    np.testing.assert_allclose(
        terms.jacobians[0, 5], -1, atol=0.01
    )  # the object's +z is towards it
    np.testing.assert_allclose(terms.jacobians[0, 3:5], 0, atol=0.05)


@pytest.mark.parametrize("log_theta", [-12.0, -9.0, 0.0])
def test_each_row_has_the_papers_loss_and_the_weight_it_leaves(log_theta):
    theta, w_tac, w_pen = np.exp(log_theta), 3.0, 5.0
    pads, T_wp = pads_around(8, count=10, distance=RADIUS)
    closest = ClosestPoints(pads, lump_sdf(8))
    touching = np.arange(10) % 3 > 0
    closest.place(T_wp)
    phi, J, _ = closest.at(gtsam.Pose3())
    terms = terms_of(closest, touching, w_tac, w_pen, theta)
    fill(terms, gtsam.Pose3())
    gap, inside = touching & (phi > 0), phi < 0
    assert gap.sum() >= 2 and inside.sum() >= 2
    e = np.where(gap, w_tac, w_pen * inside) * phi**2
    loss = np.where(gap, theta - theta * np.exp(-e / theta), e)
    weight = np.where(gap, w_tac * np.exp(-e / theta), w_pen * inside)
    np.testing.assert_allclose(terms.losses**2, loss, rtol=1e-9, atol=1e-20)
    np.testing.assert_allclose(terms.rows, np.sqrt(weight) * phi, rtol=1e-9)
    np.testing.assert_allclose(terms.jacobians, np.sqrt(weight)[:, None] * J, rtol=1e-9)


def test_an_outlier_silences_only_its_own_row():
    pads, T_wp = pads_around(2, count=3, distance=RADIUS)
    T_wp[1, :3, 3] *= 5.0
    closest = ClosestPoints(pads, ball_sdf(RADIUS, 64))
    closest.place(T_wp)
    terms = terms_of(closest, [True] * 3, theta=1e-5)
    fill(terms, gtsam.Pose3())
    norms = np.linalg.norm(terms.jacobians, axis=1)
    assert norms[1] < 1e-12 < 0.5 < norms[0]


def test_the_factor_has_the_terms_cost_and_linearization():
    pads, T_wp = pads_around(9, count=6, distance=RADIUS)
    closest = ClosestPoints(pads, lump_sdf(9))
    closest.place(T_wp)
    terms = terms_of(closest, [True] * 6, theta=1e-5)
    factor, values = hand_factor(0, terms), values_at(gtsam.Pose3())
    assert factor.error(values) == pytest.approx(0.5 * (terms.losses**2).sum(), rel=1e-12)
    A, b = factor.linearize(values).jacobian()
    np.testing.assert_array_equal(A, terms.jacobians)
    np.testing.assert_array_equal(b, -terms.rows)


def test_the_same_pose_is_searched_once_and_another_frame_anew():
    terms = terms_of(facing_pad(0.004), [True])
    fill(terms, gtsam.Pose3())
    terms.rows[0] = 7.0
    fill(terms, gtsam.Pose3())
    assert terms.rows[0] == 7.0
    terms.place(terms.closest.T_wp.copy(), np.array([True]))
    fill(terms, gtsam.Pose3())
    assert terms.rows[0] != 7.0


def test_a_pose_that_is_not_finite_is_an_error_and_no_search():
    terms = terms_of(facing_pad(0.004), [True])
    broken = gtsam.Pose3(gtsam.Rot3(), np.array([np.nan, 0, 0]))
    assert not fill(terms, broken)
    with pytest.raises(FactorError, match="not finite at the pose"):
        hand_factor(0, terms).error(values_at(broken))
    assert fill(terms, gtsam.Pose3())


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


def moved_rows(terms, T_wo):
    fill(terms, T_wo)
    return terms.rows.copy()


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
        # 1e-7: short of the next grid point becoming the closest
        terms = terms_of(closest, [True, True], 4.0, 4.0)
        fill(terms, T_wo)
        rows, J = terms.rows.copy(), terms.jacobians.copy()
        for i, xi in enumerate(1e-7 * np.eye(6)):
            ahead, behind = (moved_rows(terms, T_wo.retract(sign * xi)) for sign in (1, -1))
            np.testing.assert_allclose((ahead - behind) / 2e-7, J[:, i], atol=1e-5)
        assert (np.abs(rows) > 0).all()
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
    graph.push_back(hand_factor(0, terms_of(closest, [True] * 10)))
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
