# SPDX-License-Identifier: MIT
"""Which word a frame gets."""

import gtsam
import numpy as np
import pytest
from hand_frames import values_at
from problems import alone, box_sdf, pads_around

from vtgtsam import Measurement
from vtgtsam.frame import check
from vtgtsam.graph import frame_factors
from vtgtsam.sdf.search import ClosestPoints
from vtgtsam.status import STALL, Fit, held_by_hand, newton_step_length, status_of

HERE = values_at(gtsam.Pose3())
NOTHING = np.zeros((6, 6))


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
    return frame_factors(check(measurement, pads), closest, 0, alone(method=method))


def fit(frame_factors, visual_weight=1.0, moved=True, values=HERE):
    """A solver that ended there."""
    return Fit(frame_factors, values, 1, 0.0, moved, visual_weight)


def test_many_pads_hold_a_box_and_no_pad_holds_none():
    assert held_by_hand(fit(factors(distance=0.035)))
    assert not held_by_hand(fit(factors(distance=0.06, touching=False)))


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
    config = alone(method=frame.get("method", "vis+tac+pen"))
    assert status_of(fit(factors(**frame), visual_weight), NOTHING, config) == status


def test_memory_may_hold_what_nothing_measures_now():
    nothing = fit(factors(distance=0.06, touching=False, seen=False), 0.0)
    assert status_of(nothing, np.eye(6), alone(method="vis+tac+pen+mem")) == "ok"
    assert status_of(nothing, NOTHING, alone(method="vis+tac+pen+mem")) == "unobservable"


def off_by(way):
    """A visual pose ``way`` [m] from where the solver stays."""
    pads, T_hp = pads_around(1, count=4, distance=0.06)
    seen = gtsam.Pose3(gtsam.Rot3(), np.array([way, 0.0, 0.0]))
    measurement = Measurement(0.0, np.zeros(4, bool), T_wp=T_hp, T_wo_visual=seen)
    closest = ClosestPoints(pads, box_sdf())
    return frame_factors(check(measurement, pads), closest, 0, alone(log_theta_vis=20.0))


def test_a_stall_is_a_step_that_was_promised_and_not_taken():
    far, near = off_by(2 * STALL), off_by(STALL / 2)
    assert status_of(fit(far, moved=False), NOTHING, alone()) == "stalled"
    assert status_of(fit(far), NOTHING, alone()) == "ok"
    assert status_of(fit(near, moved=False), NOTHING, alone()) == "ok"


def test_the_step_is_as_long_as_the_way_to_go():
    assert newton_step_length(fit(off_by(0.004))) == pytest.approx(0.004, rel=1e-3)
