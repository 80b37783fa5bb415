# SPDX-License-Identifier: MIT
"""The factors of pads whose joints' zeros are unknown: contacts that stand off, and pads that do not touch."""

import gtsam
import numpy as np
import pytest
from jacobians import assert_jacobian_matches
from problems import lump_sdf

from vtgtsam import load_hand
from vtgtsam.factors.clearance import clearance_factor
from vtgtsam.factors.jointed_pads import JointedPads
from vtgtsam.factors.known_offsets import known_offsets_factor
from vtgtsam.factors.offset_contacts import contact_factor, contact_residual
from vtgtsam.sdf.search import ClosestPoints

GAP, OVERLAP = 0.0005, 0.0003  # [m]


@pytest.fixture(scope="module")
def hand():
    return load_hand("isyhand")


@pytest.fixture(scope="module")
def closest(hand):
    return ClosestPoints(hand, lump_sdf(0))


def unit(count):
    return gtsam.noiseModel.Unit.Create(count)


def values_at(T_ho, zeros, offsets):
    values = gtsam.Values()
    values.insert(0, T_ho)
    values.insert(1, np.asarray(zeros, dtype=float))
    values.insert(2, np.asarray(offsets, dtype=float))
    return values


def situation(hand, seed):
    """Joints, an object somewhere in the hand, zeros and offsets."""
    rng = np.random.default_rng(seed)
    joints = rng.uniform(0.1, 1.0, len(hand.joint_names))
    centre = hand.pad_transforms(joints)[seed % len(hand), :3, 3]  # so that a pad is inside
    T_ho = gtsam.Pose3(gtsam.Rot3.Expmap(rng.normal(0, 1, 3)), centre + rng.normal(0, 0.01, 3))
    return joints, T_ho, rng.normal(0, 0.02, len(joints)), rng.normal(0, 0.001, len(hand))


def test_zeros_count_as_joints_that_are_elsewhere(hand, closest):
    joints, T_ho, zeros, _ = situation(hand, 0)
    touching = np.ones(len(hand), dtype=bool)
    here = JointedPads(hand, closest, joints, touching)
    there = JointedPads(hand, closest, joints - zeros, touching)
    none = np.zeros_like(zeros)
    np.testing.assert_array_equal(here.at(T_ho, zeros).distances, there.at(T_ho, none).distances)
    np.testing.assert_array_equal(
        here.derivative_by_zeros(T_ho, zeros), there.derivative_by_zeros(T_ho, none)
    )


def test_the_last_answer_is_kept_for_its_own_pose_and_zeros_only(hand, closest):
    joints, T_ho, zeros, _ = situation(hand, 1)
    pads = JointedPads(hand, closest, joints, np.ones(len(hand), dtype=bool))
    first = pads.at(T_ho, zeros)
    assert pads.at(T_ho, zeros.copy()) is first
    assert not np.array_equal(pads.at(T_ho, zeros + 0.1).distances, first.distances)
    slopes = pads.derivative_by_zeros(T_ho, zeros)
    assert not np.array_equal(pads.derivative_by_zeros(T_ho, zeros + 0.1), slopes)
    moved = gtsam.Pose3(T_ho.rotation(), T_ho.translation() + 0.01)
    assert not np.array_equal(pads.at(moved, zeros).distances, first.distances)


def test_a_gap_and_an_overlap_are_weighed_apart_about_the_offset():
    residual, slope = contact_residual(
        np.array([0.002, 0.001]), np.array([0.0015, 0.0016]), GAP, OVERLAP
    )
    np.testing.assert_allclose(residual, [1.0, -2.0])
    np.testing.assert_allclose(slope, [1 / GAP, 1 / OVERLAP])


@pytest.mark.parametrize("seed", range(6))
def test_the_contacts_jacobians_match_finite_differences(hand, closest, seed):
    joints, T_ho, zeros, offsets = situation(hand, seed)
    touching = np.random.default_rng(seed).random(len(hand)) < 0.6
    pads = JointedPads(hand, closest, joints, touching)
    factor = contact_factor(0, 1, 2, pads, GAP, OVERLAP, unit(np.count_nonzero(touching)))
    values = values_at(T_ho, zeros, offsets)
    # In sigmas a metre is 3300; the kinks of the field and of the closest points lie farther away than the step.
    assert_jacobian_matches(factor, values, step=1e-8, atol=1e-2)


@pytest.mark.parametrize("seed", range(6))
def test_the_clearances_jacobians_match_finite_differences(hand, closest, seed):
    joints, T_ho, zeros, _ = situation(hand, seed)
    pads = JointedPads(hand, closest, joints, np.arange(len(hand)) % 3 == (seed + 1) % 3)
    factor = clearance_factor(0, 1, pads, unit(np.count_nonzero(~pads.touching)))
    values = values_at(T_ho, zeros, np.zeros(len(hand)))
    values.erase(2)
    assert np.linalg.norm(factor.linearize(values).jacobian()[0]) > 0.5
    assert_jacobian_matches(factor, values, step=1e-7, atol=1e-5)


def test_a_pad_that_does_not_touch_counts_where_it_is_inside_only(hand, closest):
    joints, T_ho, zeros, _ = situation(hand, 2)
    apart = np.zeros(len(hand), dtype=bool)
    factor = clearance_factor(0, 1, JointedPads(hand, closest, joints, apart), unit(len(hand)))
    values = values_at(T_ho, zeros, np.zeros(len(hand)))
    everywhere = JointedPads(hand, closest, joints, ~apart).at(T_ho, zeros).distances
    np.testing.assert_allclose(
        factor.whitenedError(values), np.minimum(everywhere, 0.0), atol=1e-12
    )
    assert everywhere.min() < 0 < everywhere.max()


def test_what_is_known_of_both_keeps_its_correlations():
    rng = np.random.default_rng(3)
    root = rng.normal(size=(9, 9))
    covariance, mean = root @ root.T, rng.normal(size=9)
    factor = known_offsets_factor(0, 1, mean, covariance)
    values = gtsam.Values()
    off = rng.normal(size=9)
    values.insert(0, mean[:6] + off[:6])
    values.insert(1, mean[6:] + off[6:])
    assert factor.error(values) == pytest.approx(off @ np.linalg.solve(covariance, off) / 2)
    assert_jacobian_matches(factor, values, atol=1e-5)
