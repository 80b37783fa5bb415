# SPDX-License-Identifier: MIT
import numpy as np
import pytest

from vtgtsam.grasp import GraspController, GraspDescription
from vtgtsam.grasp import controller as c

NAMES = ("wrist_yaw", "a0", "a1", "t0", "t1")
LIMITS = np.array([(-1, 1), (-0.2, 1.5), (-0.2, 1.5), (-0.2, 1.5), (-1.2, 0.3)])
DT = 0.01


def description(**changes):
    fields = {
        "hand": "none",
        "fingers": (("a0", "a1"),),
        "thumb": ("t0", "t1"),
        "opens": ("t1",),
        "start": {"wrist_yaw": 0.3, "a0": 0.1},
        "palm": {"center": (0, 0, 0), "normal": (0, 0, 1), "fingers": (1, 0, 0)},
    }
    return GraspDescription.model_validate({**fields, **changes})


def close_freely(until, **changes):
    """Commands over time of a hand whose joints follow at once; shape (N, J)."""
    controller = GraspController(description(**changes), NAMES, LIMITS)
    commands, joints = [], controller.command
    for time in np.arange(-0.5, until, DT):
        joints = controller.step(time, DT, joints)
        commands.append(joints)
    return np.arange(-0.5, until, DT), np.array(commands)


def test_before_time_zero_the_hand_stays_open():
    time, commands = close_freely(0.5)
    start = [0.3, 0.1, 0.0, 0.0, 0.0]
    np.testing.assert_array_equal(commands[time < 0], np.tile(start, (np.sum(time < 0), 1)))


def test_inner_joints_close_first_and_the_thumb_after_the_fingers():
    time, commands = close_freely(6.0)
    moved = np.abs(commands - commands[0]) > 1e-9
    begins = dict(zip(NAMES[1:], time[moved[:, 1:].argmax(axis=0)], strict=True))
    assert begins["a0"] < begins["a1"] < begins["t0"] < begins["t1"]
    assert begins["t0"] >= time[np.isclose(commands[:, 1:3], 1.5).all(axis=1)][0] - 0.2


def test_commands_grow_at_the_rate_and_end_at_the_limits():
    _, commands = close_freely(6.0)
    steps = np.abs(np.diff(commands, axis=0))
    assert steps.max() == pytest.approx(c.RATE * DT)
    np.testing.assert_allclose(commands[-1], [0.3, 1.5, 1.5, 1.5, -1.2])


def test_a_joint_that_is_held_up_is_led_by_the_lead_only():
    controller = GraspController(description(), NAMES, LIMITS)
    blocked = np.array([0.3, 0.4, 0.2, 0.1, -0.1])
    for time in np.arange(0.0, 6.0, DT):
        command = controller.step(time, DT, blocked)
    np.testing.assert_allclose(command - blocked, [0, c.LEAD, c.LEAD, c.LEAD, -c.LEAD])


def test_a_joint_pushed_open_is_followed():
    controller = GraspController(description(), NAMES, LIMITS)
    for time in np.arange(0.0, 1.0, DT):
        command = controller.step(time, DT, controller.command)
    opened = command - 0.5
    assert controller.step(1.0, DT, opened)[1] == pytest.approx(opened[1] + c.LEAD)


def test_a_hand_without_thumb_closes_its_fingers():
    time, commands = close_freely(2.5, thumb=())
    np.testing.assert_allclose(commands[-1], [0.3, 1.5, 1.5, 0.0, 0.0])
