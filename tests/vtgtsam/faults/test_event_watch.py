# SPDX-License-Identifier: MIT
"""Events from modes, touching pads and poses in the hand, without any estimator."""

import gtsam
import numpy as np

from vtgtsam.faults.events import EventWatch

PERIOD = 1 / 30  # [s]
AT_REST = gtsam.Pose3()
SURE = np.diag([0.01**2] * 3 + [0.001**2] * 3)  # rad, m


def began(frames, covariance=SURE):
    """The events and their frames, of a mode, a number of touching pads and a pose each frame."""
    watch = EventWatch()
    found = []
    for n, (mode, touching, T_ho) in enumerate(frames):
        found += [(n, event) for event in watch.after(n * PERIOD, mode, touching, T_ho, covariance)]
    return found


def moved(by):
    """Poses (30 frames) in which the object moves by so much [m] in the fifteenth."""
    there = gtsam.Pose3(gtsam.Rot3(), np.array([by, 0.0, 0.0]))
    return [("held", 3, AT_REST)] * 15 + [("held", 3, there)] * 15


def test_what_is_held_by_three_pads_is_grasped_soon():
    assert began([("held", 3, AT_REST)] * 10) == [(6, "grasped")]  # after 0.2 s


def test_what_two_pads_keep_touching_is_grasped_and_can_be_dropped():
    pinched = [("moving", 2, AT_REST)] * 40
    assert began(pinched + [("free", 0, AT_REST)] * 6) == [(30, "grasped"), (43, "dropped")]
    assert began([("moving", 1, AT_REST)] * 40) == []
    in_passing = [("moving", 2, AT_REST)] * 20 + [("moving", 1, AT_REST)] * 20
    assert began(in_passing) == []


def test_a_way_of_more_than_4_mm_is_a_slip():
    assert (15, "slipping") in began(moved(0.0041))
    assert not [event for _, event in began(moved(0.0039)) if event == "slipping"]


def test_a_way_that_the_pose_is_unsure_of_is_none():
    unsure = np.diag([0.01**2] * 3 + [0.002**2, 0.001**2, 0.001**2])
    assert "slipping" not in dict(map(reversed, began(moved(0.0049), unsure)))
    assert "slipping" in dict(map(reversed, began(moved(0.0051), unsure)))  # 2.5 sigmas
    unsure_elsewhere = np.diag([0.5**2] * 3 + [0.001**2, 1.0, 1.0])
    assert "slipping" in dict(map(reversed, began(moved(0.0041), unsure_elsewhere)))


def test_a_way_along_what_nothing_measures_is_none():
    unmeasured = np.diag([np.inf] * 3 + [np.inf, 0.001**2, 0.001**2])
    assert "slipping" not in dict(map(reversed, began(moved(0.01), unmeasured)))
    others = np.diag([np.inf] * 3 + [0.001**2] * 3)
    assert "slipping" in dict(map(reversed, began(moved(0.01), others)))
