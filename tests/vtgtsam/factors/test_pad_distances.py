# SPDX-License-Identifier: MIT
"""What the tactile and the penetration factor of a frame share: one search a pose."""

import gtsam
import numpy as np
import pytest
from hand_frames import pads_about, values_at
from problems import ball_sdf, box_sdf, lump_sdf, pads_around, random_pose
from reference import Problem

from vtgtsam import PadSet
from vtgtsam.factors.noise import distance_noise
from vtgtsam.factors.pad_distances import PadDistances
from vtgtsam.factors.penetration import penetration_factor
from vtgtsam.factors.tactile import tactile_factor
from vtgtsam.sdf.search import ClosestPoints


@pytest.fixture
def searches(monkeypatch):
    """The poses at which closest points are searched for."""
    found = []
    search = ClosestPoints.search

    def noted(self, T_ho, *arguments):
        found.append(T_ho)
        return search(self, T_ho, *arguments)

    monkeypatch.setattr(ClosestPoints, "search", noted)
    return found


@pytest.mark.parametrize("seed", range(12))
def test_distances_agree_with_an_independent_search(seed):
    rng = np.random.default_rng(seed)
    sdf = [lump_sdf(seed), box_sdf(), ball_sdf()][seed % 3]
    pads, T_hp = pads_around(seed, count=6, distance=rng.uniform(0.02, 0.08))
    T_ho = random_pose(rng, 1.0, 0.01)
    T_hp = random_pose(rng, 2.0, 0.02) @ T_hp  # some pads end beyond the grid
    points = [pad.points_p for pad in pads.pads]
    problem = Problem(sdf.values, sdf.lower, sdf.upper, points, T_hp, None, None)
    phi, J, points_o = problem.closest(T_ho)
    frame = PadDistances(ClosestPoints(pads, sdf), T_hp, np.ones(6, bool))
    found = frame.at(gtsam.Pose3(T_ho))
    np.testing.assert_allclose(found.distances, phi, atol=1e-12)
    np.testing.assert_allclose(found.jacobians, J, atol=1e-9)
    points_h = points_o @ T_ho[:3, :3].T + T_ho[:3, 3]
    np.testing.assert_allclose(frame.points_h(found), points_h, atol=1e-12)


def test_two_factors_search_once_at_a_pose(searches):
    pads = pads_about(1)
    graph = gtsam.NonlinearFactorGraph()
    graph.push_back(tactile_factor(0, pads, distance_noise(8, 1.0)))
    graph.push_back(penetration_factor(0, pads, distance_noise(8, 1.0)))
    here = values_at(gtsam.Pose3())
    graph.error(here)
    graph.linearize(here)
    graph.error(values_at(gtsam.Pose3()))
    assert len(searches) == 1
    graph.error(values_at(gtsam.Pose3(gtsam.Rot3(), np.array([0.001, 0, 0]))))
    assert len(searches) == 2


def test_what_is_remembered_is_no_other_poses_answer():
    """Two keys, two poses, in turn: the answer at each is its own."""
    pads, T = pads_about(2), gtsam.Pose3(gtsam.Rot3.Rx(0.1), np.array([0.002, 0.001, 0.0]))
    first, second = (tactile_factor(key, pads, distance_noise(8, 1.0)) for key in (0, 1))
    values = values_at(gtsam.Pose3())
    values.insert(1, T)
    errors = [factor.error(values) for _ in range(3) for factor in (first, second)]
    fresh = tactile_factor(0, pads_about(2), distance_noise(8, 1.0))
    expected = [fresh.error(values_at(pose)) for pose in (gtsam.Pose3(), T)]
    assert errors == expected * 3 and expected[0] != expected[1]


def test_a_pad_that_neither_touches_nor_reaches_into_the_object_is_left_out():
    pads = pads_about(3, distance=0.05, touching=False)
    contacts = pads.at(gtsam.Pose3())
    assert np.isinf(contacts.distances).all() and not contacts.jacobians.any()
    assert np.isnan(pads.points_h(contacts)).all()
    assert np.isfinite(pads.everywhere(gtsam.Pose3()).distances).all()


def test_what_it_was_made_from_may_change_afterwards():
    pads, T_hp = pads_around(4)
    touching = np.ones(8, bool)
    frame = PadDistances(ClosestPoints(pads, lump_sdf(4)), T_hp, touching)
    other = PadDistances(ClosestPoints(pads, lump_sdf(4)), T_hp.copy(), touching.copy())
    T_hp[:], touching[:] = np.nan, False
    np.testing.assert_array_equal(
        frame.at(gtsam.Pose3()).distances, other.at(gtsam.Pose3()).distances
    )


def test_frames_that_share_a_search_do_not_disturb_each_other():
    pads, T_hp = pads_around(5)
    closest, T = ClosestPoints(pads, lump_sdf(5)), gtsam.Pose3()
    far = T_hp.copy()
    far[:, :3, 3] *= 1.2
    near = PadDistances(closest, T_hp, np.ones(8, bool))
    before = near.at(T).distances.copy()
    assert (PadDistances(closest, far, np.ones(8, bool)).at(T).distances > before).all()
    np.testing.assert_array_equal(near.at(T).distances, before)
    near.at(gtsam.Pose3(gtsam.Rot3(), np.array([0.001, 0, 0])))
    np.testing.assert_array_equal(near.at(T).distances, before)


def test_the_order_of_the_pads_does_not_matter():
    pads, T_hp = pads_around(4)
    order = np.random.default_rng(4).permutation(len(pads))
    shuffled = PadSet(pads.pads[k] for k in order)
    sdf, every, T = lump_sdf(4), np.ones(8, bool), gtsam.Pose3()
    straight = PadDistances(ClosestPoints(pads, sdf), T_hp, every).at(T).distances
    mixed = PadDistances(ClosestPoints(shuffled, sdf), T_hp[order], every).at(T).distances
    np.testing.assert_array_equal(mixed, straight[order])
