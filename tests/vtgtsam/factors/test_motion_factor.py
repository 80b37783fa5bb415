# SPDX-License-Identifier: MIT
import gtsam
import numpy as np
import pytest
from jacobians import assert_jacobian_matches
from reference import exp_se3

from vtgtsam.factors.motion import motion_factor, widened


def poses(count, seed=0):
    rng = np.random.default_rng(seed)
    return [gtsam.Pose3(exp_se3(rng.normal(0, 0.4, 6))) for _ in range(count)]


def information(seed):
    root = np.random.default_rng(seed).normal(size=(6, 6))
    return root @ root.T


def values_at(T):
    values = gtsam.Values()
    values.insert(0, T)
    return values


@pytest.mark.parametrize("seed", range(4))
def test_the_cost_is_the_twists_in_the_information(seed):
    before, now = poses(2, seed)
    xi = before.localCoordinates(now)
    factor = motion_factor(0, before, information(seed))
    assert factor.error(values_at(now)) == pytest.approx(0.5 * xi @ information(seed) @ xi)
    assert factor.error(values_at(before)) == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("T_ho", [gtsam.Pose3(), *poses(5, seed=3)])
def test_the_jacobian_matches_finite_differences(T_ho):
    assert_jacobian_matches(motion_factor(0, poses(1, 9)[0], information(1)), values_at(T_ho))


def test_a_direction_that_nothing_has_measured_costs_nothing():
    known = np.diag([4.0, 4.0, 4.0, 9.0, 9.0, 0.0])
    factor = motion_factor(0, gtsam.Pose3(), known)
    along = gtsam.Pose3(gtsam.Rot3(), np.array([0.0, 0.0, 0.3]))
    across = gtsam.Pose3(gtsam.Rot3(), np.array([0.2, 0.0, 0.0]))
    assert factor.error(values_at(along)) == pytest.approx(0.0, abs=1e-12)
    assert factor.error(values_at(across)) == pytest.approx(0.5 * 9 * 0.2**2)


def test_widening_adds_covariances():
    known, spread = information(2) + np.eye(6), np.diag([1.0, 2, 3, 0.1, 0.2, 0.3])
    expected = np.linalg.inv(np.linalg.inv(known) + spread)
    np.testing.assert_allclose(widened(known, spread), expected, rtol=1e-9, atol=1e-12)


def test_widening_knows_nothing_new_where_nothing_was_known():
    known = np.diag([4.0, 4.0, 4.0, 9.0, 9.0, 0.0])
    found = widened(known, np.eye(6) * 0.01)
    assert abs(found[5]).max() < 1e-12
    assert found[0, 0] == pytest.approx(1 / (1 / 4 + 0.01))
