# SPDX-License-Identifier: MIT
import gtsam
import numpy as np

from vtgtsam import Measurement
from vtgtsam.evaluation.phases import phases_of, turn_phases


def hand_at(degrees: list[float]) -> list[gtsam.Pose3]:
    return [gtsam.Pose3(gtsam.Rot3.Ry(np.radians(angle)), np.ones(3)) for angle in degrees]


def test_before_until_it_leaves_and_after_once_it_has_arrived():
    assert turn_phases(hand_at([0, 1, 3, 20, 42, 44, 45])) == [
        *["before"] * 2,
        *["turning"] * 3,
        *["after"] * 2,
    ]


def test_a_hand_that_overshoots_has_turned_when_it_stays():
    assert turn_phases(hand_at([0, 45, 49, 45, 45]))[1:] == ["turning", "turning", "after", "after"]


def test_a_hand_that_trembles_or_comes_back_has_not_turned():
    assert turn_phases(hand_at([0, 1, 3, 0.5, 1])) == ["before"] * 5
    assert turn_phases(hand_at([0, 45, 0])) == ["before"] * 3


def test_it_does_not_depend_on_the_hands_first_pose():
    T = gtsam.Pose3(gtsam.Rot3.RzRyRx(1.0, -0.5, 2.0), np.array([1.0, 2.0, 3.0]))
    poses = hand_at([0, 0, 20, 45, 45])
    assert turn_phases([T * pose for pose in poses]) == turn_phases(poses)


def test_a_jump_has_no_frames_in_between():
    assert turn_phases(hand_at([0, 0, 45, 45])) == ["before", "before", "after", "after"]


def test_no_frames_have_no_phase():
    assert turn_phases([]) == []


def test_a_hand_whose_pose_is_not_given_stands_at_the_origin():
    turned = gtsam.Pose3(gtsam.Rot3.Ry(np.radians(45)), np.zeros(3))
    frames = [Measurement(0.1 * n, [], T_wh=T) for n, T in enumerate((None, None, turned))]
    assert phases_of(frames) == ["before", "before", "after"]
