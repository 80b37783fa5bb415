# SPDX-License-Identifier: MIT
import numpy as np
import pytest
from problems import lump_sdf, pads_around, random_pose

from vtgtsam.sdf.search import ClosestPoints


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
    first = closest.search(random_pose(rng), T_wp, np.ones(3, dtype=bool))
    kept = [array.copy() for array in first]
    closest.search(random_pose(rng), T_wp, np.ones(3, dtype=bool))
    for array, copy in zip(first, kept, strict=True):
        np.testing.assert_array_equal(array, copy)


EYE, EYES, ALL = np.eye(4), np.tile(np.eye(4), (3, 1, 1)), np.ones(3, dtype=bool)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ((EYE[:3], EYES, ALL), r"T_wo must .*\(4, 4\), got float64 of shape \(3, 4\)"),
        ((EYE.astype(np.float32), EYES, ALL), "T_wo must .*float64.* got float32"),
        ((np.asfortranarray(EYE + 0.1), EYES, ALL), "T_wo .* not contiguous"),
        ((EYE, EYES[:2], ALL), r"T_wp must .*\(3, 4, 4\), got .*\(2, 4, 4\)"),
        ((EYE, EYES, ALL[:2]), r"needed must .*\(3,\), got bool of shape \(2,\)"),
        ((EYE, EYES, ALL.astype(int)), "needed must .*bool.* got int64"),
    ],
)
def test_a_wrong_array_is_refused_in_words(arguments, message):
    closest = ClosestPoints(pads_around(0, count=3)[0], lump_sdf(0))
    with pytest.raises(ValueError, match=message):
        closest.search(*arguments)


def test_indices_of_another_hand_are_refused():
    pads, T_wp = pads_around(0, count=3)
    closest = ClosestPoints(pads, lump_sdf(0))
    with pytest.raises(ValueError, match=r"indices must .*\(3,\)"):
        closest.points(T_wp, np.zeros(4, dtype=np.int64))
    with pytest.raises(ValueError, match="indices must"):
        closest.points(T_wp, np.array([0, 1, len(pads.points_p)]))
