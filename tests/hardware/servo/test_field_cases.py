# SPDX-License-Identifier: MIT
"""What went wrong on other people's servos: each case with the outcome that is right."""

from __future__ import annotations

import re
import time

import numpy as np
import pytest

from hardware.device import CommandError
from hardware.emulate.servo import EmulatedServo
from hardware.emulate.servos import ServoLineEmulator
from hardware.live.health import check_servos
from hardware.servo.bus import BusError, ServoError, TorqueError
from hardware.servo.description import HandDescription
from hardware.servo.hand import Hand


def with_joint(description, name, **changes):
    joints = [
        joint.model_copy(update=changes) if joint.name == name else joint
        for joint in description.joints
    ]
    return description.model_copy(update={"joints": tuple(joints)})


def cycles(hand, count, period=0.005):
    for _ in range(count):
        state = hand.state()
        time.sleep(period)
    return state


class TestZerosNearTheSeam:
    """A servo counts from 0 to 4095 after power on; a joint's zero may lie anywhere in there."""

    def test_a_servo_that_was_switched_off_beyond_the_seam_counts_from_the_other_end(self):
        with ServoLineEmulator([13]) as line:
            line.plant.place(13, -500.0)
            time.sleep(0.05)
            line.servos[13].reboot()
            assert line.servos[13].get("present_position") == 3596

    @pytest.mark.parametrize(
        ("zero", "sign"),
        [
            (4095, 1),
            pytest.param(0, -1, marks=pytest.mark.slow),
            pytest.param(100, 1, marks=pytest.mark.slow),
            pytest.param(2048, -1, marks=pytest.mark.slow),
        ],
    )
    def test_angles_and_commands_do_not_know_of_it(self, description, line, zero, sign):
        description = with_joint(description, "index_proximal", zero=zero, sign=sign)
        tick = 2 * np.pi / 4096
        line.plant.place(13, zero + sign * round(0.5 / tick))
        time.sleep(0.05)
        line.servos[13].reboot()  # so that it counts from 0 to 4095
        with Hand(description, line.path) as hand:
            for _ in range(10):
                if not (state := hand.state()).ages.any():
                    break
                time.sleep(0.1)
            assert state.angles["index_proximal"] == pytest.approx(0.5, abs=tick)
            hand.configure()
            hand.enable()
            for _ in range(150):
                state = hand.state()
                if state.ages.any():  # a busy machine: refused where it has gone on for long
                    continue
                here = state.angles["index_proximal"]
                hand.command({"index_proximal": here + np.clip(-0.1 - here, -0.2, 0.2)})
                time.sleep(0.005)
            assert hand.state().angles["index_proximal"] == pytest.approx(-0.1, abs=0.01)

    def test_a_joint_far_outside_its_limits_says_what_to_do(self, description, line):
        line.plant.place(13, 2048.0 + 1200)
        time.sleep(0.05)
        with Hand(description, line.path) as hand:
            hand.configure()
            with pytest.raises(
                ServoError, match=r"servo 13\) stands at -1.84 rad.*calibrate-joints"
            ):
                hand.enable()


class TestSlowLines:
    def test_a_cycle_of_more_than_20_ms_is_refused(self, description):
        slow = description.model_copy(update={"baud": 57600})
        with ServoLineEmulator([j.id for j in slow.joints], baud=57600) as line:
            with Hand(slow, line.path) as hand:
                hand.configure()
                with pytest.raises(ServoError, match=r"takes 130 ms, at most 20 .* 1000000"):
                    hand.enable()
            assert not any(servo.torque for servo in line.servos.values())

    def test_check_does_not_advise_a_rate_that_is_too_slow(self, description):
        with ServoLineEmulator([j.id for j in description.joints], baud=57600) as line:
            (problem,) = check_servos(description, line.path).problems
        assert "servos answer at 57600 baud" in problem
        assert "set the servos to 1000000 baud" in problem

    @pytest.mark.slow  # asks at every rate
    def test_check_advises_a_rate_that_is_fast_enough(self, description):
        with ServoLineEmulator([j.id for j in description.joints], baud=3_000_000) as line:
            (problem,) = check_servos(description, line.path).problems
        assert "write `baud: 3000000` in the hand's file" in problem

    def test_check_finds_the_one_servo_at_another_rate(self, description, line):
        line.servos[12].set("baud_rate", 1)
        problems = check_servos(description, line.path).problems
        assert problems == [
            "index_middle (servo 12) answers at 57600 baud, the others at 1000000: set it to 1000000 "
            "(Dynamixel Wizard)"
        ]

    def test_check_finds_a_servo_as_it_was_delivered(self, description, line):
        del line.servos[12]
        line.servos[1] = EmulatedServo(1, 57600)
        problems = check_servos(description, line.path).problems
        assert problems[0] == "index_middle (servo 12) does not answer: check cable and id"
        assert "a servo with id 1, as delivered, answers at 57600 baud" in problems[1]

    def test_check_suspects_two_servos_of_one_id(self, description, line):
        del line.servos[12]
        double = EmulatedServo(13, 1_000_000)
        double.advance(0.789)  # switched on at another time
        line.doubles.append(double)
        problems = check_servos(description, line.path).problems
        assert any("have two servos the id 13" in problem for problem in problems)
        assert any("index_middle (servo 12) does not answer" in problem for problem in problems)


class TestWatchdogAndTorque:
    def test_a_hand_can_be_enabled_again_after_a_pause_longer_than_its_watchdog(
        self, description, line
    ):
        quick = description.model_copy(update={"watchdog": 0.2})
        with Hand(quick, line.path) as hand:
            hand.configure()
            hand.enable()
            time.sleep(0.5)
            assert line.servos[13].tripped
            hand.enable()
            assert not any(servo.tripped for servo in line.servos.values())

    def test_a_tripped_watchdog_is_seen_though_nothing_is_commanded(self, hand, line):
        with line.lock:
            line.servos[43].set("bus_watchdog", -1)
        with pytest.raises(ServoError, match=r"servo 43\) was stopped by its watchdog.*paused"):
            cycles(hand, 5 * 15 + 5)
        assert not any(servo.torque for servo in line.servos.values())

    def test_torque_that_another_program_took_off_is_seen(self, hand, line):
        with line.lock:
            line.servos[22].set("torque_enable", 0)
        with pytest.raises(ServoError, match=r"servo 22\) has no torque any more.*another program"):
            cycles(hand, 5 * 15 + 5)

    def test_a_cable_that_comes_off_is_the_cause_that_is_told(self, description, line):
        with pytest.raises(TorqueError) as caught, Hand(description, line.path) as hand:
            hand.configure()
            hand.enable()
            line.faults.silent = {12, 11}
            cycles(hand, 20)
        line.faults.silent = set()
        text = str(caught.value)
        assert re.match(
            r"no answer from index_middle \(servo 12\), index_distal \(servo 11\) in 5 cycles: check cable",
            text,
        )
        assert text.count("cut the power") == 1
        assert "\n" not in text


class TestSupplyAndLine:
    def test_a_weak_supply_is_told_once_and_in_the_end(self, hand, line, caplog):
        with line.lock:
            line.servos[51].set("present_input_voltage", 39)
        cycles(hand, 10)
        assert caplog.text.count("palm_inner (servo 51) has 3.9 V, too little") == 1
        assert any("palm_inner (servo 51) 3.9 V" in remark for remark in hand.remarks())

    @pytest.mark.slow  # many cycles
    def test_lost_answers_are_told_in_the_end(self, hand, line):
        assert hand.remarks() == []
        line.faults.drop = 0.1
        cycles(hand, 20)
        line.faults.drop = 0.0
        assert any("answers lost" in remark for remark in hand.remarks())


class TestAnotherHand:
    """A hand in the manner of the LEAP hand: 16 XC330s, numbers for names, no pads."""

    @pytest.fixture
    def leap(self, description):
        gains = {"P": 600, "I": 0, "D": 200}
        joints = [
            {
                "name": i,
                "id": i,
                "sign": 1,
                "zero": 2048,
                "limits": (-0.3, 2.2),
                "gains": gains,
            }
            | {"current": 0.5}
            for i in range(16)
        ]
        relaxed = {"watchdog": 2.0, "patience": 0.1}
        return HandDescription.model_validate(
            {
                "hand": "leap.xml",
                "servo": "XC330-M288-T",
                "baud": 4_000_000,
                "joints": joints,
                **relaxed,
            }
        )

    def test_it_works_by_its_file_alone(self, leap):
        with ServoLineEmulator(range(16), baud=4_000_000, model="XC330-M288-T") as line:
            assert check_servos(leap, line.path).problems == []
            with Hand(leap, line.path) as hand:
                hand.configure()
                hand.enable()
                for _ in range(60):
                    state = hand.state()
                    if state.ages.any():  # a busy machine: refused where it has gone on for long
                        continue
                    hand.command({"3": min(state.angles["3"] + 0.2, 1.0)})
                    time.sleep(0.005)
                assert hand.state().angles["3"] == pytest.approx(1.0, abs=0.01)
            assert line.servos[3].get("current_limit") == 500

    def test_another_model_than_the_files_is_said_in_one_short_line(self, leap, description):
        wrong = leap.model_copy(update={"servo": "XL330-M288-T"})
        with ServoLineEmulator(range(16), baud=4_000_000, model="XC330-M288-T") as line:
            with pytest.raises(BusError) as caught:
                Hand(wrong, line.path)
        assert str(caught.value) == (
            "all 16 servos are XC330-M288-T, the hand's file says XL330-M288-T: write "
            "`servo: XC330-M288-T` in the hand's file"
        )

    def test_the_current_that_an_xc330_takes_is_too_much_for_an_xl330(self, leap):
        content = leap.model_dump()
        content["joints"][0]["current"] = 2.0
        HandDescription.model_validate(content)
        content["servo"] = "XL330-M288-T"
        with pytest.raises(ValueError, match=r"0 \(servo 0\): current must be at most 1.75 A"):
            HandDescription.model_validate(content)


def test_joints_are_commanded_by_name_only(hand):
    hand.state()
    with pytest.raises(CommandError, match="no joints index_midle; there are: thumb_rotation"):
        hand.command({"index_midle": 0.0})
