# SPDX-License-Identifier: MIT
"""The penetration factor: the object is pushed out of every pad, touching or not."""

import gtsam
import numpy as np
import pytest
from hand_frames import RADIUS, VOXEL, facing_pad, pads_about, smooth_frames, values_at
from jacobians import assert_jacobian_matches

from vtgtsam.exceptions import FactorError
from vtgtsam.factors.noise import distance_noise
from vtgtsam.factors.penetration import (
    penetration_factor,
    penetration_jacobian,
    penetration_residual,
)

ONE = distance_noise(1, 1.0)
HERE = values_at(gtsam.Pose3())


def test_a_depth_is_the_residual_and_a_gap_is_none():
    np.testing.assert_array_equal(
        penetration_residual(np.array([0.004, -0.002, np.inf])), [0, -0.002, 0]
    )


@pytest.mark.parametrize("touching", [True, False])
def test_the_factor_pushes_out_of_a_pad_and_leaves_a_gap_alone(touching):
    inside = penetration_factor(0, facing_pad(-0.004, touching), ONE)
    assert inside.whitenedError(HERE)[0] == pytest.approx(-0.004, abs=VOXEL**2 / RADIUS)
    J, b = inside.linearize(HERE).jacobian()
    step = J.T @ b
    assert step[5] < -0.0039  # the pad is above: down
    gap = penetration_factor(0, facing_pad(0.004, touching), ONE)
    assert gap.error(HERE) == 0.0 and not gap.linearize(HERE).jacobian()[0].any()


def test_every_pad_has_a_row():
    pads = pads_about(1, distance=0.02, touching=False)
    distances = pads.everywhere(gtsam.Pose3()).distances
    assert (distances < 0).sum() >= 4
    rows = penetration_factor(0, pads, distance_noise(8, 1.0)).whitenedError(HERE)
    np.testing.assert_allclose(rows, np.minimum(distances, 0), atol=1e-12)


def test_jacobians_match_finite_differences():
    active = 0
    for pads, T_ho in smooth_frames(distance=RADIUS - 0.003):
        factor = penetration_factor(0, pads, distance_noise(2, 4.0))
        active += np.count_nonzero(factor.whitenedError(values_at(T_ho)))
        # 1e-7: short of the next grid point becoming the closest
        assert_jacobian_matches(factor, values_at(T_ho), step=1e-7, atol=1e-5)
    assert active >= 10


def test_the_jacobian_is_none_where_there_is_a_gap():
    J = np.arange(12.0).reshape(2, 6) + 1
    found = penetration_jacobian(np.array([0.1, -0.1]), J)
    np.testing.assert_array_equal(found, [np.zeros(6), J[1]])


def test_the_error_is_half_the_weighted_square_of_the_depths():
    pads = pads_about(4, distance=0.025)
    depths = np.minimum(pads.everywhere(gtsam.Pose3()).distances, 0)
    error = penetration_factor(0, pads, distance_noise(8, 9.0)).error(HERE)
    assert error == pytest.approx(9.0 * (depths**2).sum() / 2, rel=1e-12) and error > 0


def test_it_pushes_an_object_out_of_the_pads_and_the_error_falls_each_step():
    graph = gtsam.NonlinearFactorGraph()
    graph.push_back(penetration_factor(0, facing_pad(-0.004, touching=False), ONE))
    optimizer = gtsam.LevenbergMarquardtOptimizer(graph, HERE)
    errors = [graph.error(HERE)]
    for _ in range(3):
        optimizer.iterate()
        errors.append(optimizer.error())
    assert (np.diff(errors) <= 0).all() and errors[-1] < errors[0] / 100
    assert optimizer.values().atPose3(0).z() == pytest.approx(-0.004, abs=5e-4)


def test_a_pose_that_is_not_finite_is_an_error_and_no_search():
    factor = penetration_factor(0, facing_pad(-0.004), ONE)
    broken = gtsam.Pose3(gtsam.Rot3(), np.array([np.nan, 0, 0]))
    with pytest.raises(FactorError, match="no distances at a pose that is not finite"):
        factor.error(values_at(broken))
    assert factor.error(HERE) > 0
