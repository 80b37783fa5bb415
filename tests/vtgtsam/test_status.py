# SPDX-License-Identifier: MIT
"""Which word a frame gets."""

import gtsam
import numpy as np
import pytest
from hand_frames import values_at
from problems import box_sdf, pads_around

from vtgtsam import EstimatorConfig, Measurement
from vtgtsam.frame import check
from vtgtsam.graph import frame_factors
from vtgtsam.sdf.search import ClosestPoints
from vtgtsam.status import STALL, held_by_hand, newton_step_length, status_of

HERE = values_at(gtsam.Pose3())
NOTHING = np.zeros((6, 6)), np.zeros(6)


def factors(method="vis+tac+pen", seen=True, distance=0.032, touching=True):
    """A frame's factors about a box at the origin, held all around where ``touching``."""
    pads, T_hp = pads_around(1, count=14, distance=distance)
    measurement = Measurement(
        time=0.0,
        contacts=np.full(14, touching),
        T_wp=T_hp,
        T_wo_visual=gtsam.Pose3() if seen else None,
    )
    closest = ClosestPoints(pads, box_sdf())
    return frame_factors(check(measurement, pads), closest, 0, EstimatorConfig(method=method))


def test_many_pads_hold_a_box_and_no_pad_holds_none():
    assert held_by_hand(factors(distance=0.035), HERE)
    assert not held_by_hand(factors(distance=0.06, touching=False), HERE)


@pytest.mark.parametrize(
    ("frame", "visual_weight", "status"),
    [
        ({}, 1.0, "ok"),
        ({"distance": 0.06, "touching": False}, 1.0, "ok"),
        ({"distance": 0.035}, 0.0, "ok"),  # vision is refused, and the pads hold
        ({"distance": 0.06, "touching": False}, 0.0, "lost"),
        ({"distance": 0.06, "touching": False, "seen": False}, 0.0, "unobservable"),
        ({"distance": 0.035, "seen": False}, 0.0, "ok"),
        ({"method": "vis+pen", "distance": 0.06, "seen": False}, 0.0, "unobservable"),
        ({"method": "vis"}, 1.0, "ok"),
        ({"method": "vis", "seen": False}, 0.0, "lost"),
    ],
)
def test_the_word_says_whether_something_holds_the_pose(frame, visual_weight, status):
    assert status_of(factors(**frame), HERE, visual_weight, NOTHING, stuck=False) == status


def test_a_stall_is_a_step_that_was_promised_and_not_taken():
    far = np.eye(6), np.array([0, 0, 0, 2 * STALL, 0, 0])
    near = np.eye(6), np.array([0, 0, 0, STALL / 2, 0, 0])
    assert status_of(factors(), HERE, 1.0, far, stuck=True) == "stalled"
    assert status_of(factors(), HERE, 1.0, far, stuck=False) == "ok"
    assert status_of(factors(), HERE, 1.0, near, stuck=True) == "ok"


def test_a_radian_of_the_step_counts_as_a_tenth_of_a_metre():
    information = np.diag([2.0] * 6)
    step = np.array([0.03, 0, 0, 0.004, 0, 0])
    assert newton_step_length(information, information @ step) == pytest.approx(0.005)
