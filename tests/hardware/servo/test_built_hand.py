# SPDX-License-Identifier: MIT
"""Ids, signs, zeros and limits of the built hand. Change a line here only together with the hand."""

from __future__ import annotations

import math

from hardware.servo.description import load_description
from vtgtsam import load_hand

#                    id, sign, zero, limits [rad], (P, I, D), cap [A]
FINGER, PALM = (400, 0, 400), (1000, 0, 100)
BUILT = {
    "thumb_rotation": (24, 1, 2048, (-1.13, 1.13), FINGER, 0.3),
    "thumb_proximal": (23, -1, 2048, (-0.2, 1.57), FINGER, 0.3),
    "thumb_middle": (22, -1, 2048, (-0.2, 1.57), FINGER, 0.3),
    "thumb_distal": (21, -1, 2048, (-0.2, 1.57), FINGER, 0.3),
    "index_proximal": (13, -1, 2048, (-0.2, 1.57), FINGER, 0.3),
    "index_middle": (12, -1, 2048, (-0.2, 1.57), FINGER, 0.3),
    "index_distal": (11, -1, 2048, (-0.2, 1.57), FINGER, 0.3),
    "palm_inner": (51, 1, 2048, (-0.44, 0.44), PALM, 0.75),
    "middle_proximal": (33, -1, 2048, (-0.2, 1.57), FINGER, 0.3),
    "middle_middle": (32, -1, 2048, (-0.2, 1.57), FINGER, 0.3),
    "middle_distal": (31, -1, 2048, (-0.2, 1.57), FINGER, 0.3),
    "palm_outer": (52, 1, 2048, (-0.44, 0.44), PALM, 0.75),
    "ring_proximal": (43, -1, 2048, (-0.2, 1.57), FINGER, 0.3),
    "ring_middle": (42, -1, 2048, (-0.2, 1.57), FINGER, 0.3),
    "ring_distal": (41, -1, 2048, (-0.2, 1.57), FINGER, 0.3),
}


def test_the_built_hand_is_as_it_was_built():
    described = {
        j.name: (j.id, j.sign, j.zero, j.limits, (j.gains.P, j.gains.I, j.gains.D), j.current)
        for j in load_description("isyhand").joints
    }
    assert described == BUILT


def test_rules_for_the_built_hand():
    hand = load_description("isyhand")
    assert (hand.baud, hand.watchdog, hand.max_step, hand.max_speed) == (1_000_000, 0.2, 0.35, 5.5)
    assert hand.check_clocks


def test_counts_at_known_angles():
    joints = {joint.name: joint for joint in load_description("isyhand").joints}
    assert joints["index_proximal"].ticks(math.pi / 2) == 1024  # flexion counts downwards
    assert joints["index_proximal"].ticks(-0.2) == 2178  # the public driver's own limit
    assert joints["thumb_rotation"].ticks(-1.13) == 1311
    assert joints["palm_inner"].ticks(0.44) == 2335
    assert joints["palm_inner"].angle(2048 + 1024) == math.pi / 2
    assert joints["ring_distal"].angle(1024) == math.pi / 2


def test_the_model_of_the_hand_has_the_same_joints_in_the_same_order():
    description = load_description("isyhand")
    model = load_hand(description.hand)
    assert tuple(model.joint_names) == description.joint_names
    ranges = model.model.jnt_range.tolist()
    assert [list(joint.limits) for joint in description.joints] == ranges
