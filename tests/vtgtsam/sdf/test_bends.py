# SPDX-License-Identifier: MIT
"""Bounds of how far a field is from linear hold everywhere, on smooth fields and on noise."""

import numpy as np
import pytest
from problems import HALF, ball_sdf, box_sdf, lump_sdf

from vtgtsam import GridSdf
from vtgtsam.sdf.bends import BLOCK


def rough_sdf():
    noise = np.random.default_rng(0).normal(0, 0.003, (17, 20, 23))  # no axis like another
    return GridSdf(noise, [-HALF] * 3, [HALF] * 3)


FIELDS = {"lump": lambda: lump_sdf(0), "box": box_sdf, "ball": ball_sdf, "rough": rough_sdf}


@pytest.mark.parametrize("field", FIELDS)
@pytest.mark.parametrize("reach", [1, 3, 6])
def test_no_step_leaves_the_bound(field, reach):
    sdf, rng = FIELDS[field](), np.random.default_rng(reach)
    most = np.array(sdf.values.shape) - 1
    begin = rng.uniform(0, most, (20_000, 3))  # in cells
    end = np.clip(begin + rng.uniform(-reach, reach, begin.shape), 0, most)
    bent, bound = bent_and_bound(sdf, begin, end, reach)
    assert (bent <= bound + 1e-15).all()


def bent_and_bound(sdf, begin, end, reach):
    """How far the field is from linear on steps from ``begin`` to ``end`` [cells], and its bound."""
    phi, gradient = sdf.value_and_gradient(sdf.lower + begin / sdf.scale)
    step = (end - begin) / sdf.scale
    bent = np.abs(sdf.value(sdf.lower + end / sdf.scale) - phi - (gradient * step).sum(axis=1))
    xx, yy, zz, xy, xz, yz = sdf.bends(reach)[tuple(begin.astype(int).T // BLOCK)].T
    dx, dy, dz = np.abs(end - begin).T
    bound = xx * dx * (1 + dx / 2) + yy * dy * (1 + dy / 2) + zz * dz * (1 + dz / 2)
    return bent, bound + xy * dx * dy + xz * dx * dz + yz * dy * dz


@pytest.mark.parametrize("axis", range(3))
def test_a_kink_reaches_the_bound(axis):
    place = np.stack(np.meshgrid(*[np.arange(9.0)] * 3, indexing="ij"), axis=-1)
    sdf = GridSdf(np.abs(place[..., axis] - 4), [0] * 3, [8] * 3)
    begin, end = np.full((1, 3), 3.5), np.full((1, 3), 3.5)
    begin[0, axis], end[0, axis] = 4 - 1e-9, 4.01
    bent, bound = bent_and_bound(sdf, begin, end, 2)
    assert bent == pytest.approx(bound, rel=0.01)


@pytest.mark.parametrize("axes", [(0, 1), (0, 2), (1, 2)])
def test_a_saddle_reaches_the_bound(axes):
    place = np.stack(np.meshgrid(*[np.arange(9.0)] * 3, indexing="ij"), axis=-1)
    sdf = GridSdf(place[..., axes[0]] * place[..., axes[1]], [0] * 3, [8] * 3)
    begin, end = np.full((1, 3), 3.5), np.full((1, 3), 3.5)
    end[0, list(axes)] += 2.25
    bent, bound = bent_and_bound(sdf, begin, end, 3)
    assert bent == pytest.approx(bound, rel=1e-3)


def test_a_linear_field_has_no_bends():
    x, y, z = np.meshgrid(*[np.arange(9.0)] * 3, indexing="ij")
    sdf = GridSdf(0.5 * x + 0.25 * y - z, [0] * 3, [8] * 3)
    assert sdf.bends(2).shape == (2, 2, 2, 6)
    assert sdf.bends(2).max() <= 2e-6 * sdf.largest
