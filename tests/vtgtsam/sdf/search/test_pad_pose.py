# SPDX-License-Identifier: MIT
"""What is said of all points of a pad at once holds for each of them, and says something."""

import numba
import numpy as np
import pytest
from problems import lump_sdf, random_pose
from reference import exp_se3

from vtgtsam import Pad, PadSet
from vtgtsam.sdf.search.field import read_field
from vtgtsam.sdf.search.pad_pose import (
    cells_from_pad,
    motion,
    placement,
    relative_pose,
    slope_anywhere,
)
from vtgtsam.sdf.search.single_precision import tile_bounds, tile_distances
from vtgtsam.sdf.search.tiles import TILE, cut_into_tiles


@pytest.fixture(scope="module")
def sdf():
    return lump_sdf(0)


@pytest.fixture(scope="module")
def pad():
    rng = np.random.default_rng(0)
    return Pad("dome", (0.02, 0.02), rng.normal(0, [0.006, 0.004, 0.001], (80, 3)))


def poses(count):
    """Poses of a pad in the object's frame, near it and away from it."""
    rng = np.random.default_rng(1)
    for n in range(count):
        T = random_pose(rng, 1.0, 0.0)
        T[:3, 3] = rng.uniform(-1, 1, 3) * (0.03 if n % 2 else 0.1)
        yield T[:3].copy()


def box_of(pad):
    return cut_into_tiles(PadSet([pad]), 0.0).pad_boxes[0]


def points_o(pad, T_op):
    return pad.points_p @ T_op[:, :3].T + T_op[:, 3]


def test_the_relative_pose_is_the_pads_pose_in_the_objects_frame():
    rng = np.random.default_rng(2)
    T_wo, T_wp, T_op = random_pose(rng, 2.0, 1.0), random_pose(rng, 2.0, 1.0), np.empty((3, 4))
    relative_pose(T_wo, T_wp, T_op)
    np.testing.assert_allclose(T_op, (np.linalg.inv(T_wo) @ T_wp)[:3], atol=1e-14)


@pytest.mark.parametrize("size", [1e-6, 1e-3, 0.1, 3.0])
def test_no_point_moves_by_more_than_the_motion(pad, size):
    rng = np.random.default_rng(3)
    box = box_of(pad)
    for before in poses(20):
        step = size * np.concatenate([rng.normal(0, 1, 3), rng.normal(0, 0.01, 3)])
        after = (np.vstack([before, [0, 0, 0, 1]]) @ exp_se3(step))[:3].copy()
        moved = np.linalg.norm(points_o(pad, after) - points_o(pad, before), axis=1).max()
        assert moved <= motion(before, after, box) * (1 + 1e-12) + 1e-15
        assert motion(before, after, box) <= 4 * moved  # and it says something


def test_no_distance_changes_by_more_than_the_slope_times_the_way(sdf):
    rng = np.random.default_rng(4)
    field = read_field(sdf, 0.002)
    for half, slope in ((0.06, field.slope), (0.15, slope_anywhere(field))):
        a = rng.uniform(-half, half, (20_000, 3))
        b = np.clip(a + rng.normal(0, 0.01, a.shape), -half, half)
        change = np.abs(sdf.value(a) - sdf.value(b))
        assert (change <= slope * np.linalg.norm(a - b, axis=1)).all()


def test_a_pad_counts_as_inside_only_where_all_its_points_are(sdf, pad):
    field, box, seen = read_field(sdf, 0.002), box_of(pad), set()
    for T_op in poses(200):
        inside, far, _ = placement(field, T_op, box)
        points = points_o(pad, T_op)
        within = ((points > sdf.lower) & (points < sdf.upper)).all()
        assert not far and (within or not inside)
        seen.add(bool(inside))
    assert seen == {True, False}


@pytest.mark.parametrize("place", [0, 1, 2])
@pytest.mark.parametrize("away", [1e3, 1e9, np.inf, np.nan])
def test_a_pad_far_away_along_any_axis_counts_as_far(sdf, pad, place, away):
    T_op = np.eye(4)[:3].copy()
    T_op[place, 3] = away
    inside, far, _ = placement(read_field(sdf, 0.002), T_op, box_of(pad))
    assert far and not inside


@numba.njit
def in_single_precision(field, tiles, T_op, inside, near, bounds):
    """Each point's distance and each tile's bound and least distance, compiled as in the search."""
    A, least = np.empty((3, 4), np.float32), np.empty(len(near), np.float32)
    cells_from_pad(field, T_op, A)
    tile_bounds(field, A, inside, tiles.boxes, 0, bounds)
    for tile in range(len(near)):
        least[tile] = tile_distances(field, A, inside, tiles.coordinates, tile * TILE, near[tile])
    return least


@pytest.mark.parametrize("size", [None, (0.014, 0.018)])
def test_single_precision_is_off_by_less_than_its_rounding_and_no_tile_is_below_its_bound(
    sdf, pad, size
):
    tiles = cut_into_tiles(PadSet([Pad("grid", size) if size else pad]), 1e-6)
    field, box = read_field(sdf, tiles.radius), tiles.pad_boxes[0]
    near, bounds = (
        np.empty((tiles.counts[0], TILE), np.float32),
        np.empty(tiles.counts[0], np.float32),
    )
    slack, seen = [], set()
    for T_op in poses(60):
        inside, _, rounding = placement(field, T_op, box)
        least = in_single_precision(field, tiles, T_op, inside, near, bounds)
        exact = sdf.value(tiles.points @ T_op[:, :3].T + T_op[:, 3]).reshape(-1, TILE)
        assert np.abs(near - exact).max() <= rounding
        np.testing.assert_array_equal(least, near.min(axis=1))
        assert (bounds - rounding <= exact.min(axis=1)).all()
        slack.extend(exact.min(axis=1) - bounds)
        seen.add(bool(inside))
    assert seen == {True, False}
    assert np.median(slack) < (0.0015 if size else 0.01)  # [m]: the bounds say something
