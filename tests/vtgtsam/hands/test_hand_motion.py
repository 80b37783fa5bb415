# SPDX-License-Identifier: MIT
"""How a hand moves of which only the pads are known."""

import gtsam
import numpy as np
import pytest
from problems import pads_around

from vtgtsam import Pad, PadSet, load_hand
from vtgtsam.hands.motion import hand_motion

LARGE = gtsam.Pose3(gtsam.Rot3.RzRyRx(1.0, -0.5, 2.5), np.array([0.3, -2.0, 0.5]))
HALF_TURN = gtsam.Pose3(gtsam.Rot3.Rz(np.pi), np.array([0.1, 0.0, 0.0]))
SHIFT = gtsam.Pose3(gtsam.Rot3(), np.array([0.0, 0.0, 0.1]))


@pytest.mark.parametrize("motion", [gtsam.Pose3(), SHIFT, HALF_TURN, LARGE])
@pytest.mark.parametrize("count", [1, 2, 16])
def test_a_motion_of_the_whole_hand_is_found_exactly(motion, count):
    pads, T_wp = pads_around(count, count)
    found = hand_motion(pads, T_wp, motion.matrix() @ T_wp)
    assert found.equals(motion, 1e-9)


def test_pads_in_one_plane_are_no_mirror():
    pads = PadSet(Pad(f"pad_{k}", (0.01, 0.01)) for k in range(4))
    T_wp = np.tile(np.eye(4), (4, 1, 1))
    T_wp[:, :2, 3] = [[0, 0], [0.05, 0], [0, 0.05], [0.05, 0.05]]
    found = hand_motion(pads, T_wp, HALF_TURN.matrix() @ T_wp)
    assert found.equals(HALF_TURN, 1e-9)


@pytest.mark.parametrize("motion", [gtsam.Pose3(), LARGE])
def test_fingers_that_close_move_the_hand_by_less_than_they_move(motion):
    hand = load_hand("isyhand")
    before = hand.pad_transforms(dict.fromkeys(hand.joint_names, 0.30))
    closed = hand.pad_transforms(dict.fromkeys(hand.joint_names, 0.32))
    found = hand_motion(hand, before, motion.matrix() @ closed)
    error = motion.between(found)
    pads_moved = np.linalg.norm(closed[:, :3, 3] - before[:, :3, 3], axis=1)
    middle = before[:, :3, 3].mean(axis=0)
    shifted = np.linalg.norm(error.transformFrom(middle) - middle)
    assert shifted < pads_moved.max() and pads_moved.max() > 1e-3
    turns = before[:, :3, :3].transpose(0, 2, 1) @ closed[:, :3, :3]
    pads_turned = [np.linalg.norm(gtsam.Rot3.Logmap(gtsam.Rot3(R))) for R in turns]
    assert np.linalg.norm(gtsam.Rot3.Logmap(error.rotation())) < max(pads_turned) / 2


def test_one_finger_of_many_hardly_counts():
    pads, T_wp = pads_around(3, 16)
    now = T_wp.copy()
    now[0, :3, 3] += [0.004, 0.0, 0.0]
    found = hand_motion(pads, T_wp, now)
    assert np.linalg.norm(found.translation()) < 0.004 / 4
    assert np.linalg.norm(gtsam.Rot3.Logmap(found.rotation())) < 0.01


def test_the_fit_is_the_best_one():
    """No small motion beside it brings the pads closer together."""
    pads, T_wp = pads_around(4, 5)
    now = LARGE.matrix() @ T_wp
    now[:, :3, 3] += np.random.default_rng(4).normal(0, 0.002, (5, 3))
    found = hand_motion(pads, T_wp, now)

    def misfit(motion):
        total = 0.0
        for pad, before, after in zip(pads.pads, T_wp, now, strict=True):
            for sx, sy in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
                corner = np.array([sx * pad.size[0] / 2, sy * pad.size[1] / 2, 0.0, 1.0])
                total += np.sum((after @ corner - motion.matrix() @ before @ corner) ** 2)
        return total

    least = misfit(found)
    for xi in np.vstack([np.eye(6), -np.eye(6)]):
        assert misfit(found.retract(1e-4 * xi)) > least


def test_the_motion_does_not_depend_on_the_worlds_frame():
    pads, T_wp = pads_around(6, 6)
    now = SHIFT.matrix() @ T_wp
    now[0, :3, 3] += 0.003
    here = hand_motion(pads, T_wp, now)
    there = hand_motion(pads, LARGE.matrix() @ T_wp, LARGE.matrix() @ now)
    assert there.equals(LARGE.compose(here).compose(LARGE.inverse()), 1e-9)
