# SPDX-License-Identifier: MIT
"""Encoders that stick in the middle of a motion, and fingers that are really blocked."""

from __future__ import annotations

import time

import pytest

from hardware.servo.bus import ServoError
from hardware.servo.description import load_description
from hardware.servo.encoders import EncoderWatch
from hardware.servo.hand import Hand

JOINT = "thumb_rotation"
SERVO = 24
CYCLE = 0.02  # [s]


def close(hand, seconds, each_cycle=lambda: None):
    """Close one joint as a grasp does: the goal grows, and leads by at most 0.3 rad."""
    goal = hand.state().angles[JOINT]
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        state = hand.state()
        if state.ages.any():  # a busy machine
            continue
        goal = min(goal + 1.2 * CYCLE, state.angles[JOINT] + 0.3, 1.1)
        hand.command({JOINT: goal})
        each_cycle()
        time.sleep(CYCLE)


def stick(line):
    with line.lock:
        line.servos[SERVO].stuck = True


def block(line, after=10):
    """Something in the way, in a few ticks."""
    with line.lock:
        line.plant.obstacles[SERVO] = line.servos[SERVO].get("present_position") + after


def test_an_encoder_that_sticks_in_a_motion_stops_the_hand_and_is_named(hand, line):
    close(hand, 0.3)
    stick(line)
    with pytest.raises(ServoError, match=r"thumb_rotation \(servo 24\) reads 0\.\d+ rad .*encoder"):
        close(hand, 3.0)
    assert not any(servo.torque for servo in line.servos.values())


def test_the_motor_runs_on_where_its_encoder_sticks(hand, line):
    close(hand, 0.3)
    stick(line)
    read = line.servos[SERVO].get("present_position")
    with pytest.raises(ServoError):
        close(hand, 3.0)
    assert line.servos[SERVO].get("present_position") == read
    with line.lock:
        line.servos[SERVO].stuck = False
    time.sleep(0.05)
    assert abs(line.servos[SERVO].get("present_position") - read) > 100  # [ticks]


def test_a_finger_that_is_blocked_and_yields_is_believed(hand, line, caplog):
    close(hand, 0.3)
    block(line)
    yields = iter([3, 2, 1, 1])

    def give_way():
        with line.lock:
            line.plant.obstacles[SERVO] += next(yields, 0)

    close(hand, 1.5, give_way)
    assert line.servos[SERVO].get("present_current") > 250  # [mA], it does pull
    assert "thumb_rotation" not in caplog.text
    assert hand.remarks() == []


@pytest.mark.slow  # seconds under current
def test_a_dead_stop_under_full_current_is_said_once_and_stops_nothing(hand, line, caplog):
    close(hand, 0.3)
    block(line)
    stick(line)  # what its motor then draws is what a finger on something very hard draws
    close(hand, 1.5)
    assert hand.enabled
    assert caplog.text.count("thumb_rotation (servo 24) stopped dead at 0.") == 1
    assert any("its encoder is stuck; look at it" in remark for remark in hand.remarks())


def test_a_servo_without_torque_is_not_called_stuck(hand, line):
    close(hand, 0.3)
    with line.lock:
        line.servos[SERVO].set("torque_enable", 0)
    with pytest.raises(ServoError, match="has no torque any more") as caught:
        close(hand, 3.0)
    assert "stuck" not in str(caught.value)


def test_it_can_be_left_out(description, line):
    trusting = description.model_copy(update={"check_encoders": False})
    with Hand(trusting, line.path) as hand:
        hand.configure()
        hand.enable()
        close(hand, 0.3)
        stick(line)
        close(hand, 0.7)


class TestByCounts:
    """A watch fed with made-up answers at 50 Hz; the cap is 300 mA, P 400."""

    @pytest.fixture
    def watch(self):
        (joint,) = [j for j in load_description("isyhand").joints if j.name == JOINT]
        watch = EncoderWatch(joint)
        self.time = 0.0
        for step in range(10):  # 16 a cycle, as at 1.2 rad/s
            self.see(watch, 1712 + 16 * step, behind=30, current=60)
        return watch

    def see(self, watch, count, behind, current):
        self.time += CYCLE
        watch.see(self.time, count, count + behind, current)

    @pytest.mark.parametrize(
        ("behind", "current", "stuck"),
        [(195, 50, True), (195, -50, True), (195, 130, False), (195, 290, False), (60, 0, False)],
    )
    def test_little_current_far_from_the_goal_is_what_tells(self, watch, behind, current, stuck):
        for _ in range(10):
            self.see(watch, 1856, behind, current)
        assert bool(watch.stuck) is stuck

    def test_one_answer_with_little_current_tells_nothing(self, watch):
        for current in [290, 20, 20, 290] * 5:
            self.see(watch, 1856, 195, current)
        assert not watch.stuck

    def test_a_joint_that_moves_by_a_tick_is_not_stuck(self, watch):
        for step in range(20):
            self.see(watch, 1856 + step // 2, 195, 20)
        assert not watch.stuck

    @pytest.mark.parametrize("last", [[1862, 1865, 1866], [1856, 1857, 1856]])
    def test_creep_or_flicker_after_the_stop_is_a_finger(self, watch, last):
        for count in last:
            self.see(watch, count, 195, 290)
        for _ in range(50):
            self.see(watch, last[-1], 195, 290)
        assert not watch.doubtful and not watch.stuck

    def test_a_dead_stop_is_doubtful(self, watch):
        for _ in range(50):
            self.see(watch, 1856, 195, 290)
        assert "stopped dead" in watch.doubtful
        assert not watch.stuck
