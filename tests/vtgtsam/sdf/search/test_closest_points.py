# SPDX-License-Identifier: MIT
"""The search with its shortcuts answers exactly what looking at every point answers."""

import copy
import inspect
import pickle

import numpy as np
import pytest
from problems import HALF, ball_sdf, box_sdf, lump_sdf, pads_around, random_pose
from reference import exp_se3

from vtgtsam import GridSdf, Pad, PadSet
from vtgtsam.sdf.search import ClosestPoints
from vtgtsam.sdf.search.compiled_search import Memory, Room, closest_on_pads
from vtgtsam.sdf.search.field import Field
from vtgtsam.sdf.search.pad_pose import place_points
from vtgtsam.sdf.search.tiles import Tiles


class PlainSearch:
    """Every point of every pad, in double precision, with the same order of operations."""

    def __init__(self, pads, sdf):
        self.pads, self.sdf = pads, sdf

    def at(self, T_wo, T_wp):
        """Distances, indices and derivatives."""
        distances, indices, jacobians = [], [], []
        for k, pad in enumerate(self.pads.pads):
            R, t = relative(T_wo, T_wp[k])
            p = pad.points_p
            points_o = ((R[:, 0] * p[:, :1] + R[:, 1] * p[:, 1:2]) + R[:, 2] * p[:, 2:]) + t
            phi, gradient = self.sdf.value_and_gradient(points_o)
            n = int(np.argmin(phi))
            indices.append(self.pads.offsets[k] + n)
            distances.append(phi[n])
            jacobians.append([*np.cross(gradient[n], points_o[n]), *-gradient[n]])
        return np.array(distances), np.array(indices), np.array(jacobians)


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


def everywhere(closest, T_wo, T_wp):
    return closest.search(T_wo, T_wp, np.ones(len(T_wp), dtype=bool))


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("seed", range(4))
def test_every_pose_of_a_walk_gives_the_plain_answer(field, seed):
    rng = np.random.default_rng(seed)
    sdf = FIELDS[field](seed)
    pads, T_wp = pads_around(seed, count=6)
    plain, closest = PlainSearch(pads, sdf), ClosestPoints(pads, sdf)
    for T_wo in walk(rng, 60):
        found = everywhere(closest, T_wo, T_wp)
        distances, indices, jacobians = plain.at(T_wo, T_wp)
        np.testing.assert_allclose(found.distances, distances, atol=1e-15)
        same = found.indices == indices
        # Another point may be found only where the two are equal up to the last bits.
        assert (np.abs(distances - found.distances)[~same] < 1e-15).all()
        assert same.mean() > 0.5
        np.testing.assert_allclose(found.jacobians[same], jacobians[same], atol=1e-9)


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
        needed = rng.random(6) < 0.7
        found = closest.search(T_wo, T_wp, needed)
        distances, _, _ = plain.at(T_wo, T_wp)
        matters = (distances < 0) | needed
        np.testing.assert_allclose(found.distances[matters], distances[matters], atol=1e-15)


def linear_along(axis, slope):
    values = np.moveaxis(np.broadcast_to(slope(np.linspace(-HALF, HALF, 49)), (49,) * 3), -1, axis)
    return GridSdf(values, [-HALF] * 3, [HALF] * 3)


SHIFT, TURN, DIAGONAL = np.eye(6)[3], np.eye(6)[1] / 0.03, np.array([0, 0, 0, -1, 0, -1])


@pytest.mark.parametrize(
    ("field", "way", "half"),
    [
        (linear_along(0, lambda x: 0.05 - np.abs(x)), SHIFT, 0.03),  # either side of a ridge
        (linear_along(2, lambda z: z), TURN, 0.03),
        (linear_along(2, lambda z: z), DIAGONAL, 0.08),  # ends outside the grid, on either side
    ],
)
@pytest.mark.parametrize("step", [0.002, 0.006, 0.02])
def test_an_end_that_comes_closer_as_fast_as_anything_can_is_found(field, way, half, step):
    pads = PadSet([Pad("bar", (0.2, 0.01), np.repeat([[-half, 0, 0], [half, 0, 0]], 40, axis=0))])
    plain, closest = PlainSearch(pads, field), ClosestPoints(pads, field)
    before = everywhere(closest, np.eye(4), exp_se3(-step * way)[None])
    end = exp_se3(0.001 * step * way)[None]  # it has just become the closest
    after = everywhere(closest, np.eye(4), end)
    assert (before.indices[0] < 40) != (after.indices[0] < 40)
    assert after.distances[0] == pytest.approx(plain.at(np.eye(4), end)[0][0], abs=1e-15)


@pytest.mark.parametrize("seed", range(6))
def test_memory_of_earlier_poses_changes_no_bit(seed):
    rng = np.random.default_rng(seed)
    sdf = lump_sdf(seed)
    pads, T_wp = pads_around(seed, count=6)
    experienced = ClosestPoints(pads, sdf)
    for T_wo in walk(rng, 40):
        needed = rng.random(6) < 0.5
        fresh = ClosestPoints(pads, sdf)
        a, b = experienced.search(T_wo, T_wp, needed), fresh.search(T_wo, T_wp, needed)
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
        needed = rng.random(6) < 0.3
        found = closest.search(T_wo, T_wp, needed)
        distances, _, _ = plain.at(T_wo, T_wp)
        matters = (distances < 0) | needed
        np.testing.assert_allclose(found.distances[matters], distances[matters], atol=1e-15)
        assert np.isinf(found.distances[~matters]).all()
        assert (found.indices[~matters] == -1).all()
        assert not found.jacobians[~matters].any()
        assert np.isnan(closest.points(T_wp, found.indices)[~matters]).all()
        all_pads = everywhere(closest, T_wo, T_wp)
        np.testing.assert_allclose(all_pads.distances, distances, atol=1e-15)
        left_out += (~matters).sum()
    assert left_out > 30


def test_of_equal_points_the_first_counts():
    flat = GridSdf(np.broadcast_to(np.linspace(-1, 1, 9), (9, 9, 9)), [-1] * 3, [1] * 3)
    closest = ClosestPoints(PadSet([Pad("pad", (0.02, 0.02))]), flat)
    T_wp, above = np.eye(4)[None], np.eye(4)
    above[2, 3] = 0.1
    for _ in range(3):
        assert everywhere(closest, np.eye(4), T_wp).indices[0] == 0
        everywhere(closest, above, T_wp)


def test_pads_far_outside_the_grid_are_found_too():
    sdf = ball_sdf()
    pads, T_wp = pads_around(2, count=4, distance=1.5)
    closest = ClosestPoints(pads, sdf)
    distances, _, _ = PlainSearch(pads, sdf).at(np.eye(4), T_wp)
    found = everywhere(closest, np.eye(4), T_wp)
    np.testing.assert_allclose(found.distances, distances, atol=1e-14)


def test_points_need_not_lie_in_a_plane():
    rng = np.random.default_rng(3)
    pads = PadSet([Pad("dome", (0.02, 0.02), rng.normal(0, 0.01, (200, 3)))])
    sdf, T_wp = lump_sdf(3), random_pose(rng)[None]
    closest = ClosestPoints(pads, sdf)
    for T_wo in walk(rng, 20):
        distances, _, _ = PlainSearch(pads, sdf).at(T_wo, T_wp)
        found = everywhere(closest, T_wo, T_wp)
        np.testing.assert_allclose(found.distances, distances, atol=1e-15)


def test_pads_of_different_sizes_answer_for_themselves():
    rng = np.random.default_rng(10)
    dome = rng.normal(0, 0.01, (301, 3))
    pads = PadSet([Pad("one", (0.01, 0.01), [[0, 0, 0]]), Pad("a", (0.014, 0.018))])
    pads = PadSet([*pads.pads, Pad("dome", (0.02, 0.02), dome), Pad("b", (0.014, 0.018))])
    sdf, T_wp = lump_sdf(4), pads_around(10, count=4)[1]
    plain, closest = PlainSearch(pads, sdf), ClosestPoints(pads, sdf)
    for T_wo in walk(rng, 40):
        distances, indices, _ = plain.at(T_wo, T_wp)
        found = everywhere(closest, T_wo, T_wp)
        np.testing.assert_allclose(found.distances, distances, atol=1e-15)
        assert ((found.indices >= pads.offsets[:-1]) & (found.indices < pads.offsets[1:])).all()
        assert (found.indices == indices).mean() > 0.5


@pytest.mark.parametrize("far", [1e2, 1e4, 1e7, 1e12, 1e20, 1e150])
def test_a_pad_that_was_far_away_is_forgotten_and_far_away_it_is_exact(far):
    rng = np.random.default_rng(7)
    sdf = lump_sdf(0)
    pads, T_wp = pads_around(0, count=6)
    plain, closest = PlainSearch(pads, sdf), ClosestPoints(pads, sdf)
    for n, T_wo in enumerate(walk(rng, 40)):
        if n % 4 == 1:
            away = np.eye(4)
            away[:3, 3] = far * rng.normal(size=3)
            found = everywhere(closest, away, T_wp)
            np.testing.assert_allclose(found.distances, plain.at(away, T_wp)[0], rtol=1e-12)
        found = everywhere(closest, T_wo, T_wp)
        np.testing.assert_allclose(found.distances, plain.at(T_wo, T_wp)[0], atol=1e-15)


@pytest.mark.parametrize("nonsense", [np.nan, np.inf])
@pytest.mark.parametrize("place", [(0, 0), (1, 2), (0, 3), (2, 3)])
def test_a_pose_that_is_not_finite_leaves_its_pads_out_and_nothing_behind(nonsense, place):
    rng = np.random.default_rng(11)
    sdf = lump_sdf(0)
    pads, T_wp = pads_around(0, count=6)
    plain, closest = PlainSearch(pads, sdf), ClosestPoints(pads, sdf)
    for T_wo in walk(rng, 8):
        broken_pads = T_wp.copy()
        broken_pads[2][place] = nonsense
        found = everywhere(closest, T_wo, broken_pads)
        assert np.isinf(found.distances[2]) and found.indices[2] == -1
        assert not found.jacobians[2].any()
        broken = T_wo.copy()
        broken[place] = nonsense
        found = everywhere(closest, broken, T_wp)
        assert np.isinf(found.distances).all() and (found.indices == -1).all()
        found = everywhere(closest, T_wo, T_wp)
        np.testing.assert_allclose(found.distances, plain.at(T_wo, T_wp)[0], atol=1e-15)


@pytest.mark.parametrize("origin", [1.0, 1e3, 1e6])
def test_points_may_lie_far_from_their_pads_origin(origin):
    rng = np.random.default_rng(8)
    shift = origin * np.array([0.6, -0.5, 0.4])
    pads = PadSet([Pad("far", (0.02, 0.02), rng.normal(0, 0.01, (60, 3)) + shift)])
    T_wp = np.eye(4)[None].copy()
    T_wp[0, :3, 3] = -shift
    sdf = lump_sdf(1)
    plain, closest = PlainSearch(pads, sdf), ClosestPoints(pads, sdf)
    for T_wo in walk(rng, 20):
        distances, _, _ = plain.at(T_wo, T_wp)
        atol = 1e-15 * max(1.0, 10 * origin)  # of the sums themselves
        np.testing.assert_allclose(everywhere(closest, T_wo, T_wp).distances, distances, atol=atol)


def test_a_few_taxels_far_apart_are_found_and_prepared_at_once():
    taxels = np.array([[-0.05, 0, 0], [0.05, 0, 0], [0, -0.05, 0], [0, 0.05, 0.0]])
    pads = PadSet([Pad("taxels", (0.1, 0.1), taxels)])
    sdf, T_wp, rng = lump_sdf(2, 128), np.eye(4)[None], np.random.default_rng(9)
    plain, closest = PlainSearch(pads, sdf), ClosestPoints(pads, sdf)
    for T_wo in walk(rng, 40):
        found = everywhere(closest, T_wo, T_wp).distances
        np.testing.assert_allclose(found, plain.at(T_wo, T_wp)[0], atol=1e-15)


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda x: pickle.loads(pickle.dumps(x))])
def test_a_copy_answers_the_same_for_itself(copied):
    rng = np.random.default_rng(12)
    pads, T_wp = pads_around(1, count=6)
    closest = ClosestPoints(pads, lump_sdf(1))
    everywhere(closest, random_pose(rng), T_wp)
    other = copied(closest)
    T_wo = random_pose(rng)
    expected = everywhere(closest, T_wo, T_wp)
    everywhere(closest, random_pose(rng, 1.0, 0.1), T_wp)
    found = everywhere(other, T_wo, T_wp)
    np.testing.assert_array_equal(found.distances, expected.distances)
    np.testing.assert_array_equal(
        other.points(T_wp, found.indices), closest.points(T_wp, expected.indices)
    )


def test_points_are_the_pads_own_in_the_world():
    pads, T_wp = pads_around(0, count=3)
    closest = ClosestPoints(pads, lump_sdf(0))
    indices = np.array([pads.offsets[0] + 5, -1, pads.offsets[2] + 7])
    points = closest.points(T_wp, indices)
    for k in (0, 2):
        expected = T_wp[k, :3, :3] @ pads.points_p[indices[k]] + T_wp[k, :3, 3]
        np.testing.assert_allclose(points[k], expected, atol=1e-15)
    assert np.isnan(points[1]).all()


def test_each_search_fills_new_arrays():
    rng = np.random.default_rng(0)
    pads, T_wp = pads_around(0, count=3)
    closest = ClosestPoints(pads, lump_sdf(0))
    first = everywhere(closest, random_pose(rng), T_wp)
    kept = [array.copy() for array in first]
    everywhere(closest, random_pose(rng), T_wp)
    for array, expected in zip(first, kept, strict=True):
        np.testing.assert_array_equal(array, expected)


EYE, EYES, ALL = np.eye(4), np.tile(np.eye(4), (3, 1, 1)), np.ones(3, dtype=bool)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((EYE[:3], EYES, ALL), r"T_wo must .*\(4, 4\), got float64 of shape \(3, 4\)"),
        ((EYE.astype(np.float32), EYES, ALL), "T_wo must .*float64.* got float32"),
        ((np.asfortranarray(EYE + 0.1), EYES, ALL), "T_wo .* not C-contiguous"),
        ((EYE, EYES[:2], ALL), r"T_wp must .*\(3, 4, 4\), got .*\(2, 4, 4\)"),
        ((EYE, EYES.swapaxes(1, 2), ALL), "T_wp .* not C-contiguous"),
        ((EYE, EYES, ALL[:2]), r"needed must .*\(3,\), got bool of shape \(2,\)"),
        ((EYE, EYES, ALL.astype(int)), "needed must .*bool.* got int64"),
    ],
)
def test_a_wrong_array_is_refused_in_words(arguments, message):
    closest = ClosestPoints(pads_around(0, count=3)[0], lump_sdf(0))
    with pytest.raises(ValueError, match=message):
        closest.search(*arguments)


@pytest.mark.parametrize(
    ("indices", "message"),
    [
        (np.zeros(4, dtype=np.int64), r"indices must .*\(3,\)"),
        (np.zeros(3, dtype=np.int32), "indices must .*int64.* got int32"),
        (np.array([0, 1, 10_000]), "indices must be those of points"),
        (np.array([0, -2, 1]), "indices must be those of points"),
    ],
)
def test_indices_of_another_hand_are_refused(indices, message):
    pads, T_wp = pads_around(0, count=3)
    with pytest.raises(ValueError, match=message):
        ClosestPoints(pads, lump_sdf(0)).points(T_wp, indices)


def read_only(array):
    array = array.copy()
    array.flags.writeable = False
    return array


def test_arrays_that_cannot_be_written_to_and_copies_of_the_field_compile_nothing_new():
    pads, T_wp = pads_around(0, count=3)
    sdf = lump_sdf(0)
    closest = ClosestPoints(pads, sdf)
    closest.points(T_wp, everywhere(closest, EYE, T_wp).indices)
    before = len(closest_on_pads.signatures), len(place_points.signatures)
    closest = ClosestPoints(*pickle.loads(pickle.dumps((pads, sdf))))
    found = closest.search(read_only(EYE), read_only(T_wp), read_only(ALL))
    closest.points(read_only(T_wp), read_only(found.indices))
    assert (len(closest_on_pads.signatures), len(place_points.signatures)) == before


def test_the_compiled_search_takes_the_fields_in_order():
    names = list(inspect.signature(closest_on_pads).parameters)[6:]
    groups = Field, Tiles, Memory, Room
    assert names == [name for group in groups for name in group._fields]
