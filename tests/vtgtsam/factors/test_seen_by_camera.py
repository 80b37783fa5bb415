# SPDX-License-Identifier: MIT
"""The visual factor of a camera whose place is unknown."""

import gtsam
import numpy as np
import pytest
from jacobians import assert_jacobian_matches
from reference import exp_se3

from vtgtsam.factors.noise import pose_noise
from vtgtsam.factors.seen_by_camera import seen_factor
from vtgtsam.factors.visual import visual_factor

NOISE = pose_noise(1.0, 1.0)
HALF_TURN = gtsam.Pose3(gtsam.Rot3.RzRyRx(np.pi - 0.01, 0, 0), np.zeros(3))
SHIFT = gtsam.Pose3(gtsam.Rot3(), np.array([0.1, -0.2, 0.3]))
ORIGIN = np.array([0.3, -0.1, 0.2])


def poses(count=10, seed=0, spread=0.5):
    rng = np.random.default_rng(seed)
    return [gtsam.Pose3(exp_se3(rng.normal(0, spread, 6))) for _ in range(count)]


def values_at(T_ho, camera):
    values = gtsam.Values()
    values.insert(0, T_ho)
    values.insert(1, np.asarray(camera, dtype=float))
    return values


def seen(T_wh, T_ho, camera, origin=ORIGIN):
    """What a camera reports whose twist is ``camera``, by matrices."""
    about = np.eye(4)
    about[:3, 3] = origin
    moved = about @ exp_se3(np.asarray(camera)) @ np.linalg.inv(about)
    return gtsam.Pose3(moved @ T_wh.matrix() @ T_ho.matrix())


def test_what_a_camera_reports_leaves_no_error_at_its_own_twist():
    rng = np.random.default_rng(1)
    for T_wh, T_ho in zip(poses(seed=2), poses(seed=3), strict=True):
        camera = rng.normal(0, 0.1, 6)
        factor = seen_factor(0, 1, T_wh, seen(T_wh, T_ho, camera), ORIGIN, NOISE)
        assert factor.error(values_at(T_ho, camera)) == pytest.approx(0, abs=1e-20)
        assert factor.error(values_at(T_ho, np.zeros(6))) > 1e-4


def test_a_turn_about_the_origin_does_not_move_an_object_that_is_there():
    T_ho = gtsam.Pose3(gtsam.Rot3(), ORIGIN)
    factor = seen_factor(0, 1, gtsam.Pose3(), T_ho, ORIGIN, NOISE)
    turned = factor.whitenedError(values_at(T_ho, [0, 0, 0.1, 0, 0, 0]))
    np.testing.assert_allclose(turned, [0, 0, 0.1, 0, 0, 0], atol=1e-12)


def test_a_camera_in_its_place_is_the_visual_factor():
    for T_wh, T_ho, T_wo_visual in zip(poses(seed=4), poses(seed=5), poses(seed=6), strict=True):
        factor = seen_factor(0, 1, T_wh, T_wo_visual, ORIGIN, NOISE)
        plain = visual_factor(0, T_wh.between(T_wo_visual), NOISE)
        values = values_at(T_ho, np.zeros(6))
        np.testing.assert_allclose(
            factor.whitenedError(values), plain.whitenedError(values), atol=1e-9
        )


@pytest.mark.parametrize(
    "camera", [np.zeros(6), [0, 0, 0, 0.1, 0.2, -0.1], [0.3, -0.2, 0.1, 0.1, 0, 0.2]]
)
@pytest.mark.parametrize("T_ho", [gtsam.Pose3(), SHIFT, HALF_TURN, *poses(4, seed=7)])
def test_the_jacobians_match_finite_differences(T_ho, camera):
    for T_wh, T_wo_visual in zip(poses(3, seed=8), poses(3, seed=9), strict=True):
        factor = seen_factor(0, 1, T_wh, T_wo_visual, ORIGIN, NOISE)
        assert_jacobian_matches(factor, values_at(T_ho, camera), atol=1e-5)  # logarithms near pi
