# SPDX-License-Identifier: MIT
"""The linear lower bounds are below the field wherever they should be, on smooth fields and on noise."""

import numpy as np
import pytest
from problems import HALF, ball_sdf, box_sdf, lump_sdf

from vtgtsam import GridSdf
from vtgtsam.sdf.search.linear_bounds import BLOCKS, block_shift, linear_lower_bounds


def rough_sdf():
    noise = np.random.default_rng(0).normal(0, 0.003, (17, 20, 23))  # no axis like another
    return GridSdf(noise, [-HALF] * 3, [HALF] * 3)


FIELDS = {"lump": lambda: lump_sdf(0), "box": box_sdf, "ball": ball_sdf, "rough": rough_sdf}


def places(sdf, reach, count=50_000):
    """Places in cells, and others within ``reach`` cells of them along each axis."""
    rng, most = np.random.default_rng(reach), np.array(sdf.values.shape) - 1
    begin = rng.uniform(0, most, (count, 3))
    return begin, np.clip(begin + rng.uniform(-reach, reach, begin.shape), 0, most)


def bound_and_distance(sdf, shift, reach):
    begin, end = places(sdf, reach)
    cell = np.minimum(begin.astype(int), np.array(sdf.values.shape) - 2)
    planes = linear_lower_bounds(sdf.values, shift, reach, sdf.largest).astype(float)
    plane = planes[tuple(cell.T >> shift)]
    return plane[:, 0] + (plane[:, 1:] * end).sum(axis=1), sdf.value(sdf.lower + end / sdf.scale)


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("reach", [1, 3, 6])
@pytest.mark.parametrize("shift", [1, 2, 3])
def test_no_place_in_reach_is_below_the_bound(field, reach, shift):
    bound, distance = bound_and_distance(FIELDS[field](), shift, reach)
    assert (bound <= distance).all()


def test_below_a_linear_field_there_is_only_rounding():
    x, y, z = np.meshgrid(*[np.arange(9.0)] * 3, indexing="ij")
    sdf = GridSdf(0.5 * x + 0.25 * y - z, [0] * 3, [8] * 3)
    bound, distance = bound_and_distance(sdf, 1, 3)
    assert (distance - bound).max() < 1e-4 * sdf.largest


def test_below_a_smooth_field_the_bound_is_near():
    bound, distance = bound_and_distance(ball_sdf(0.03, 96), 1, 2)
    assert np.median(distance - bound) < 5e-5  # [m]


@pytest.mark.parametrize(
    ("nodes", "shift"), [(2, 1), (48, 1), (128, 1), (129, 2), (256, 2), (512, 3)]
)
def test_blocks_grow_with_the_grid(nodes, shift):
    assert block_shift((nodes, 2, 2), 3) == shift
    assert nodes / 2**shift <= BLOCKS


@pytest.mark.parametrize("reach", [0, 1, 3, 4, 5, 14, 40, 10**6])
def test_the_work_hardly_depends_on_the_reach(reach):
    side = 2 ** block_shift((128, 128, 128), reach)
    blocks = -(-127 // side)
    looked_at = blocks * min(side + 2 * reach + 1, 128)
    assert looked_at <= 8 * 128  # along an axis


def test_the_smallest_grid_has_one_block():
    planes = linear_lower_bounds(np.zeros((2, 2, 2), np.float32), 1, 3, 0.0)
    assert planes.shape == (1, 1, 1, 4) and not planes.any()
