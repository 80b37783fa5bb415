# SPDX-License-Identifier: MIT
from dataclasses import replace

import gtsam
import numpy as np
import pytest
from problems import frame

from vtgtsam import load_hand
from vtgtsam.exceptions import NotFiniteError
from vtgtsam.frame import check, contact_bits, hand_of, is_pose
from vtgtsam.measurement import Measurement

T_WH = gtsam.Pose3(gtsam.Rot3.RzRyRx(0.3, -0.2, 1.0), np.array([0.1, 0.2, 0.3]))


def test_poses_are_brought_into_the_hand():
    pads, _, measurement, _ = frame(0)
    checked = check(replace(measurement, T_wh=T_WH), pads)
    T_hw = T_WH.inverse().matrix()
    np.testing.assert_allclose(checked.T_hp, T_hw @ measurement.T_wp, atol=1e-12)
    np.testing.assert_allclose(
        checked.T_ho_visual.matrix(), T_hw @ measurement.T_wo_visual.matrix(), atol=1e-12
    )
    assert checked.T_wh.equals(T_WH, 0.0) and checked.faults == ()


def test_by_joints_a_hand_whose_pose_is_unknown_stands_at_the_worlds_origin():
    hand = load_hand("isyhand")
    joints = dict.fromkeys(hand.joint_names, 0.4)
    unknown = check(Measurement(0.0, np.zeros(16, bool), joints), hand)
    assert unknown.T_wh.equals(gtsam.Pose3(), 0.0)
    known = check(Measurement(0.0, np.zeros(16, bool), joints, T_wh=T_WH), hand)
    np.testing.assert_array_equal(known.T_hp, unknown.T_hp)
    assert known.T_wh.equals(T_WH, 0.0)


def test_a_hand_known_by_its_pads_begins_at_the_worlds_origin_and_moves_with_them():
    pads, _, measurement, _ = frame(1)
    first = hand_of(measurement, pads)
    assert first.T_wh.equals(gtsam.Pose3(), 0.0)
    np.testing.assert_array_equal(first.T_hp, measurement.T_wp)
    moved = replace(measurement, T_wp=T_WH.matrix() @ measurement.T_wp)
    then = hand_of(moved, pads, before=first)
    assert then.T_wh.equals(T_WH, 1e-9)
    np.testing.assert_allclose(then.T_hp, first.T_hp, atol=1e-9)
    further = replace(measurement, T_wp=T_WH.matrix() @ moved.T_wp)
    assert hand_of(further, pads, before=then).T_wh.equals(T_WH.compose(T_WH), 1e-9)


def test_a_given_hand_pose_counts_with_given_pad_poses():
    pads, _, measurement, _ = frame(1)
    before = hand_of(measurement, pads)
    hand = hand_of(replace(measurement, T_wh=T_WH), pads, before)
    assert hand.T_wh.equals(T_WH, 0.0)
    np.testing.assert_allclose(T_WH.matrix() @ hand.T_hp, measurement.T_wp, atol=1e-12)


def test_what_the_measurement_was_made_from_may_change_afterwards():
    pads, _, measurement, _ = frame(2)
    checked = check(measurement, pads)
    T_hp, touching = checked.T_hp.copy(), checked.touching.copy()
    measurement.T_wp[:] = np.nan
    measurement.contacts[:] = ~measurement.contacts
    np.testing.assert_array_equal(checked.T_hp, T_hp)
    np.testing.assert_array_equal(checked.touching, touching)


def test_a_sigma_is_a_covariance_and_wins_over_the_trackers_own():
    pads, _, measurement, _ = frame(3)
    both = replace(measurement, visual_sigma=(0.1, 0.02), visual_covariance=np.eye(6))
    covariance = check(both, pads).visual_covariance
    np.testing.assert_allclose(covariance, np.diag([0.01] * 3 + [0.0004] * 3))
    own = check(replace(both, visual_sigma=None), pads)
    np.testing.assert_array_equal(own.visual_covariance, np.eye(6))
    assert check(replace(both, visual_sigma=None), pads, False).visual_covariance is None


@pytest.mark.parametrize(
    ("broken", "words"),
    [
        ({"T_wp": np.full((8, 4, 4), np.inf)}, "pad poses not finite"),
        ({"T_wh": gtsam.Pose3(gtsam.Rot3(), np.array([np.nan, 0, 0]))}, "hand pose not finite"),
        ({"T_wo_visual": gtsam.Pose3(gtsam.Rot3(), np.full(3, np.inf))}, "vision not finite"),
        ({"visual_sigma": (0.1, -0.1)}, "vision's covariance unusable"),
        ({"visual_covariance": np.full((6, 6), np.inf)}, "vision's covariance unusable"),
    ],
)
def test_what_is_not_finite_is_named(broken, words):
    pads, _, measurement, _ = frame(4)
    assert check(replace(measurement, **broken), pads).faults == (words,)


def test_a_covariance_that_is_not_one_is_named():
    pads, _, measurement, _ = frame(4)
    lopsided = np.eye(6)
    lopsided[0, 1] = 0.5
    for matrix in (lopsided, np.zeros((6, 6)), -np.eye(6)):
        checked = check(replace(measurement, visual_covariance=matrix), pads)
        assert checked.faults == ("vision's covariance unusable",)
        assert checked.visual_covariance is None


def test_joints_that_are_not_finite_are_an_error_where_only_the_hand_is_asked_for():
    hand = load_hand("isyhand")
    joints = dict.fromkeys(hand.joint_names, np.nan)
    with pytest.raises(NotFiniteError):
        hand_of(Measurement(0.0, np.zeros(16, bool), joints), hand)


def test_a_pose_has_a_rotation_and_lies_on_this_planet():
    T = np.tile(np.eye(4), (3, 1, 1))
    assert is_pose(T) and is_pose(T[0])
    for spoil in ((0, 0, 0, 1.1), (1, 3, 0, 0.1), (2, 0, 3, 1e9), (2, 0, 3, np.nan)):
        wrong = T.copy()
        wrong[spoil[:3]] = spoil[3]
        assert not is_pose(wrong)
    assert not is_pose(np.swapaxes(T_WH.matrix()[None], -1, -2))


def test_bits_may_come_by_name_as_numbers_or_as_bools():
    names = ("a", "b")
    for contacts in ({"b": True, "a": False, "c": True}, [0, 1], np.array([0.0, 1.0])):
        np.testing.assert_array_equal(contact_bits(contacts, names), [False, True])
