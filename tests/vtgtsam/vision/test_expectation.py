# SPDX-License-Identifier: MIT
"""Where the hand has carried an object, and how much the next image may change that."""

import gtsam
import numpy as np
import pytest
import trimesh

from vtgtsam.sdf.build import build_sdf
from vtgtsam.vision.alignment import STEP_SIGMA, Shape
from vtgtsam.vision.expectation import HELD, PUSHED, START, TOGETHER, WEAK, Expectation

T_WO = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.3, -0.2, 0.5), np.array([0.1, 0.02, 0.05]))
T_WH = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.1, 0.4, -0.3), np.array([0.02, 0.0, 0.01]))
MOVE = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.2, 0.0, 0.1), np.array([0.01, -0.03, 0.02]))
JOINTS = np.zeros(5)


@pytest.fixture(scope="module")
def ball():
    return Shape(build_sdf(trimesh.creation.icosphere(2, 0.03), resolution=32))


def variances(expected):
    return np.diag(np.linalg.inv(expected.information()))


def test_the_object_goes_where_the_hand_goes(ball):
    expected = Expectation(ball, T_WO)
    expected.carry(T_WH, JOINTS, 0.0)
    assert expected.T_wo.equals(T_WO, 1e-12)  # the first image: nothing has moved yet
    expected.carry(MOVE * T_WH, JOINTS, 0.0)
    assert expected.T_wo.equals(MOVE * T_WO, 1e-9)


def test_it_becomes_less_sure_and_more_so_where_joints_move(ball):
    still, moving = Expectation(ball, T_WO), Expectation(ball, T_WO)
    for n in range(2):
        still.carry(T_WH, JOINTS, 0.0)
        moving.carry(T_WH, JOINTS + 0.04 * n, 0.0)
    np.testing.assert_allclose(variances(still), START**2 + HELD**2)
    np.testing.assert_allclose(variances(moving), START**2 + HELD**2 + (0.04 * PUSHED) ** 2)


def test_an_image_counts_in_full_where_noise_is_new_each_time_and_little_where_it_stays(ball):
    information = np.diag(np.repeat([1e4, 1e6], 3))
    left = []
    for persistence in (0.0, 1.0):
        expected = Expectation(ball, T_WO)
        for _ in range(2):
            expected.carry(T_WH, JOINTS, persistence)
        together = 1.0 + persistence * (TOGETHER - 1.0)
        before = np.diag(together / (START**2 + HELD**2))
        np.testing.assert_allclose(expected.information(), before, rtol=1e-9)
        expected.update(T_WO, information, information)
        left.append(together / np.diag(expected.information()))
    np.testing.assert_allclose(1.0 / left[0], 1.0 / (START**2 + HELD**2) + np.diag(information))
    assert (left[1] > 0.5 * (START**2 + HELD**2)).all()


def test_what_is_new_in_each_image_averages_until_the_object_s_motion_outweighs_it(ball):
    information = np.diag(np.repeat([1e4, 1e6], 3))
    expected = Expectation(ball, T_WO)
    for _ in range(60):
        expected.carry(T_WH, JOINTS, 1.0)  # noise that stays does not change what is new in each
        expected.update(T_WO, information, information)
    # The steady state of a random walk that is measured: a = r k with k^2 / (1 - k) = q / r.
    ratio = HELD[3] ** 2 * 1e6
    gain = 0.5 * (np.sqrt(ratio**2 + 4.0 * ratio) - ratio)
    np.testing.assert_allclose(np.diag(expected.averaged)[3:], gain * 1e-6, rtol=1e-3)
    assert 1.5 < expected.images_alike < 2.0 / gain
    expected.update(T_WO, information, information, anew=True)
    np.testing.assert_allclose(np.diag(expected.averaged)[3:], 1e-6, rtol=1e-3)
    assert expected.images_alike == pytest.approx(1.0, abs=0.01)


def test_directions_that_no_image_shows_stay_unknown_whatever_was_known_at_first(ball):
    expected = Expectation(ball, T_WO)
    for _ in range(20):
        expected.carry(T_WH, JOINTS, 0.0)
        seen = np.diag([1e4, 1e4, 0.0, 1e6, 1e6, 1e6])
        expected.update(T_WO, seen, seen)
    assert expected.averaged[2, 2] >= STEP_SIGMA[2] ** 2 / WEAK


def test_what_is_not_credible_holds_the_pose_but_does_not_make_it_surer(ball):
    information = np.diag(np.repeat([1e4, 1e6], 3))
    expected = Expectation(ball, T_WO)
    for _ in range(20):
        expected.carry(T_WH, JOINTS, 0.0)
        expected.update(T_WO, information, np.diag([1e4, 1e4, 0.0, 1e6, 1e6, 1e6]))
    assert expected.averaged[2, 2] >= STEP_SIGMA[2] ** 2 / WEAK
    assert expected.information()[2, 2] > 1e4
