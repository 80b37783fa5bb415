# SPDX-License-Identifier: MIT
"""The search with its shortcuts answers exactly what looking at every point answers."""

import copy
import gc
import pickle

import gtsam
import numpy as np
import pytest
from problems import HALF, ball_sdf, box_sdf, lump_sdf, pads_around, random_pose
from reference import exp_se3

from vtgtsam import GridSdf, Pad, PadSet
from vtgtsam.sdf.closest import ClosestPoints


class PlainSearch:
    """Every point of every pad, in double precision, with the same order of operations."""

    def __init__(self, pads, sdf):
        self.pads, self.sdf = pads, sdf

    def at(self, T_wo, T_wp):
        distances, indices = [], []
        for k, pad in enumerate(self.pads.pads):
            R, t = relative(T_wo, T_wp[k])
            p = pad.points_p
            points_o = ((R[:, 0] * p[:, :1] + R[:, 1] * p[:, 1:2]) + R[:, 2] * p[:, 2:]) + t
            phi = self.sdf.value(points_o)
            indices.append(int(np.argmin(phi)))
            distances.append(phi[indices[-1]])
        return np.array(distances), np.array(indices) + self.pads.offsets[:-1]


def relative(T_wo, T_wp):
    T = np.linalg.inv(T_wo) @ T_wp
    return T[:3, :3], T[:3, 3]


def rough_sdf(seed):
    """Noise on a ball: steep, with many near-equal minima, and no distance field at all."""
    noise = np.random.default_rng(seed).normal(0, 0.003, (48, 48, 48))
    return GridSdf(ball_sdf().values + noise, [-HALF] * 3, [HALF] * 3)


FIELDS = {
    "lump": lump_sdf,
    "box": lambda s: box_sdf(),
    "ball": lambda s: ball_sdf(),
    "rough": rough_sdf,
}


def walk(rng, count):
    """Poses as an optimiser visits them: jumps between frames, then ever smaller steps."""
    T = random_pose(rng)
    for n in range(count):
        size = 10.0 ** -(n % 6)  # 1 rad and 20 mm down to nothing
        T = T @ exp_se3(size * np.concatenate([rng.normal(0, 0.3, 3), rng.normal(0, 0.02, 3)]))
        T[:3, 3] *= min(1.0, 0.1 / np.linalg.norm(T[:3, 3]))
        yield T


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("seed", range(4))
def test_every_pose_of_a_walk_gives_the_plain_answer(field, seed):
    rng = np.random.default_rng(seed)
    sdf = FIELDS[field](seed)
    pads, T_wp = pads_around(seed, count=6)
    plain, closest = PlainSearch(pads, sdf), ClosestPoints(pads, sdf)
    closest.place(T_wp)
    for T_wo in walk(rng, 60):
        found = closest.at(gtsam.Pose3(T_wo))
        distances, indices = plain.at(T_wo, T_wp)
        np.testing.assert_allclose(found.distances, distances, atol=1e-15)
        # Another point may be found only where the two are equal up to the last bits.
        np.testing.assert_array_less(
            np.abs(distances - found.distances)[found.indices != indices], 1e-15
        )


def trembling(rng, count, size):
    """Poses that go to and fro, and so come back to places that the search remembers."""
    T = random_pose(rng, 0.1, 0.001)
    for _ in range(count):
        step = size * rng.choice([0.03, 0.3, 1.0])
        yield T @ exp_se3(step * np.concatenate([rng.normal(0, 20, 3), rng.normal(0, 1, 3)]))


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("size", [1e-5, 1e-4, 1e-3, 3e-3])  # [m], and 20 times as much in radians
def test_going_to_and_fro_gives_the_plain_answer(field, size):
    rng = np.random.default_rng(round(1e6 * size))
    sdf = FIELDS[field](0)
    pads, T_wp = pads_around(0, count=6)
    plain, closest = PlainSearch(pads, sdf), ClosestPoints(pads, sdf)
    for T_wo in trembling(rng, 150, size):
        touching = rng.random(6) < 0.7
        closest.place(T_wp, touching)
        found = closest.at(gtsam.Pose3(T_wo))
        distances, _ = plain.at(T_wo, T_wp)
        matters = (distances < 0) | touching
        np.testing.assert_allclose(found.distances[matters], distances[matters], atol=1e-15)


@pytest.mark.parametrize("seed", range(6))
def test_memory_of_earlier_poses_changes_no_bit(seed):
    rng = np.random.default_rng(seed)
    sdf = lump_sdf(seed)
    pads, T_wp = pads_around(seed, count=6)
    experienced = ClosestPoints(pads, sdf)
    for T_wo in walk(rng, 40):
        touching = rng.random(6) < 0.5
        experienced.place(T_wp, touching)
        fresh = ClosestPoints(pads, sdf)
        fresh.place(T_wp, touching)
        a, b = experienced.at(gtsam.Pose3(T_wo)), fresh.at(gtsam.Pose3(T_wo))
        np.testing.assert_array_equal(a.distances, b.distances)
        np.testing.assert_array_equal(a.jacobians, b.jacobians)
        np.testing.assert_array_equal(a.indices, b.indices)


@pytest.mark.parametrize("field", FIELDS)
def test_a_pad_is_left_out_only_where_it_does_not_matter(field):
    rng = np.random.default_rng(1)
    sdf = FIELDS[field](1)
    pads, T_wp = pads_around(1, count=6)
    plain, closest = PlainSearch(pads, sdf), ClosestPoints(pads, sdf)
    left_out = 0
    for T_wo in walk(rng, 60):
        touching = rng.random(6) < 0.3
        closest.place(T_wp, touching)
        found = closest.at(gtsam.Pose3(T_wo))
        distances, _ = plain.at(T_wo, T_wp)
        matters = (distances < 0) | touching
        np.testing.assert_allclose(found.distances[matters], distances[matters], atol=1e-15)
        assert np.isinf(found.distances[~matters]).all()
        assert (found.indices[~matters] == -1).all()
        assert not found.jacobians[~matters].any()
        assert np.isnan(closest.points_w(found)[~matters]).all()
        everywhere = closest.everywhere(gtsam.Pose3(T_wo))
        np.testing.assert_allclose(everywhere.distances, distances, atol=1e-15)
        left_out += (~matters).sum()
    assert left_out > 30


def test_of_equal_points_the_first_counts():
    flat = GridSdf(np.broadcast_to(np.linspace(-1, 1, 9), (9, 9, 9)), [-1] * 3, [1] * 3)
    closest = ClosestPoints(PadSet([Pad("pad", (0.02, 0.02))]), flat)
    closest.place(np.eye(4)[None])
    for _ in range(3):
        assert closest.at(gtsam.Pose3()).indices[0] == 0
        closest.at(gtsam.Pose3(gtsam.Rot3(), np.array([0, 0, 0.1])))


def test_pads_far_outside_the_grid_are_found_too():
    sdf = ball_sdf()
    pads, T_wp = pads_around(2, count=4, distance=1.5)
    closest = ClosestPoints(pads, sdf)
    closest.place(T_wp)
    distances, _ = PlainSearch(pads, sdf).at(np.eye(4), T_wp)
    np.testing.assert_allclose(closest.at(gtsam.Pose3()).distances, distances, atol=1e-14)


def test_points_need_not_lie_in_a_plane():
    rng = np.random.default_rng(3)
    pads = PadSet([Pad("dome", (0.02, 0.02), rng.normal(0, 0.01, (200, 3)))])
    sdf, T_wp = lump_sdf(3), random_pose(rng)[None]
    closest = ClosestPoints(pads, sdf)
    closest.place(T_wp)
    for T_wo in walk(rng, 20):
        distances, _ = PlainSearch(pads, sdf).at(T_wo, T_wp)
        np.testing.assert_allclose(closest.at(gtsam.Pose3(T_wo)).distances, distances, atol=1e-15)


@pytest.mark.parametrize("far", [1e2, 1e4, 1e7, 1e12, 1e20, 1e150])
def test_a_pad_that_was_far_away_is_forgotten_and_far_away_it_is_exact(far):
    rng = np.random.default_rng(7)
    sdf = lump_sdf(0)
    pads, T_wp = pads_around(0, count=6)
    plain, closest = PlainSearch(pads, sdf), ClosestPoints(pads, sdf)
    closest.place(T_wp)
    for n, T_wo in enumerate(walk(rng, 40)):
        if n % 4 == 1:
            away = np.eye(4)
            away[:3, 3] = far * rng.normal(size=3)
            found = closest.at(gtsam.Pose3(away))
            np.testing.assert_allclose(found.distances, plain.at(away, T_wp)[0], rtol=1e-12)
        found = closest.at(gtsam.Pose3(T_wo))
        np.testing.assert_allclose(found.distances, plain.at(T_wo, T_wp)[0], atol=1e-15)


@pytest.mark.parametrize("origin", [1.0, 1e3, 1e6])
def test_points_may_lie_far_from_their_pads_origin(origin):
    rng = np.random.default_rng(8)
    shift = origin * np.array([0.6, -0.5, 0.4])
    pads = PadSet([Pad("far", (0.02, 0.02), rng.normal(0, 0.01, (60, 3)) + shift)])
    T_wp = np.eye(4)
    T_wp[:3, 3] = -shift
    sdf = lump_sdf(1)
    plain, closest = PlainSearch(pads, sdf), ClosestPoints(pads, sdf)
    closest.place(T_wp[None])
    for T_wo in walk(rng, 20):
        distances, _ = plain.at(T_wo, T_wp[None])
        atol = 1e-15 * max(1.0, 10 * origin)  # of the sums themselves
        np.testing.assert_allclose(closest.at(gtsam.Pose3(T_wo)).distances, distances, atol=atol)


def test_a_few_taxels_far_apart_are_found_and_prepared_at_once():
    taxels = np.array([[-0.05, 0, 0], [0.05, 0, 0], [0, -0.05, 0], [0, 0.05, 0.0]])
    pads = PadSet([Pad("taxels", (0.1, 0.1), taxels)])
    sdf, T_wp, rng = lump_sdf(2, 128), np.eye(4)[None], np.random.default_rng(9)
    plain, closest = PlainSearch(pads, sdf), ClosestPoints(pads, sdf)
    closest.place(T_wp)
    for T_wo in walk(rng, 40):
        found = closest.at(gtsam.Pose3(T_wo)).distances
        np.testing.assert_allclose(found, plain.at(T_wo, T_wp)[0], atol=1e-15)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))])
def test_a_copy_searches_with_arrays_of_its_own(copied):
    pads, T_wp = pads_around(1, count=6)
    closest = ClosestPoints(pads, lump_sdf(1))
    closest.place(T_wp)
    expected = closest.at(gtsam.Pose3()).distances
    other = copied(closest)
    closest.place(T_wp + [[0, 0, 0, 0.5], [0, 0, 0, 0], [0, 0, 0, 0], [0, 0, 0, 0]])
    np.testing.assert_array_equal(other.at(gtsam.Pose3()).distances, expected)
    del closest
    gc.collect()
    np.testing.assert_array_equal(other.at(gtsam.Pose3()).distances, expected)
