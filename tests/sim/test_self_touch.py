# SPDX-License-Identifier: MIT
"""A simulated hand that touches itself as planned, and what its joints' zeros gain by it."""

import numpy as np
import pytest

from sim.self_touch import make_touches
from vtgtsam import HandModel, load_hand
from vtgtsam.exceptions import HandError
from vtgtsam.factors.pad_touch import touch_residual
from vtgtsam.grasp import GraspDescription, load_grasp
from vtgtsam.grasp.self_touch import TouchController, plan_touches


@pytest.fixture(scope="module")
def hand():
    return load_hand("isyhand")


@pytest.fixture(scope="module")
def plan(hand):
    return plan_touches(hand, load_grasp("isyhand"))


def test_a_dozen_touches_come_about_though_zeros_are_off(hand, plan):
    zeros = np.random.default_rng(2).normal(0, np.deg2rad(1.0), len(hand.joint_names))
    felt = make_touches(load_grasp("isyhand"), hand, plan, zeros)
    assert len(plan) == 12 and len(felt) >= 10
    gaps = [touch_residual(hand, f.joints, zeros, f.a, f.b)[0] for f in felt]
    believed = [touch_residual(hand, f.joints, 0 * zeros, f.a, f.b)[0] for f in felt]
    assert np.std(gaps) < 0.4e-3  # where the joints are known the pads touch
    assert np.std(believed) > 2 * np.std(gaps)


def test_the_same_seed_plans_the_same(hand, plan):
    again = plan_touches(hand, load_grasp("isyhand"))
    for one, other in zip(plan, again, strict=True):
        np.testing.assert_array_equal(one.joints, other.joints)


def test_a_touch_that_does_not_come_about_is_missed(hand, plan):
    controller = TouchController(plan[0], plan[0].joints)
    nothing, joints = np.zeros(len(hand), dtype=bool), plan[0].joints
    for _ in range(5000):
        joints = controller.step(0.01, joints, nothing)
        if controller.done:
            break
    assert controller.state == "missed" and controller.joints is None


def test_a_hand_without_a_thumb_is_refused():
    xml = (
        '<mujoco model="flat"><worldbody><body><joint name="a" axis="0 1 0"/><geom size="0.01"/>'
        '<site name="pad_a" type="box" size="0.01 0.01 0.001"/></body></worldbody></mujoco>'
    )
    description = GraspDescription.model_validate(
        {
            "hand": "flat",
            "fingers": [["a"]],
            "palm": {"center": (0, 0, 0), "normal": (0, 0, 1), "fingers": (1, 0, 0)},
        }
    )
    with pytest.raises(HandError, match="has no thumb"):
        plan_touches(HandModel.from_text(xml), description)
