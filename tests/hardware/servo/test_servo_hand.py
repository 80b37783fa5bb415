# SPDX-License-Identifier: MIT
"""The hand on an emulated line: what it writes, what it refuses, and when it lets go."""

from __future__ import annotations

import math
import time

import numpy as np
import pytest

from hardware.device import CommandError
from hardware.emulate.packets import status
from hardware.emulate.servo import OVERLOAD
from hardware.emulate.servos import ServoLineEmulator
from hardware.servo.bus import BusError, ServoError, TorqueError
from hardware.servo.hand import Hand
from hardware.servo.table import STATE

TRIP = 0.4  # [s], after which a watchdog of 0.2 s has acted


def all_off(line):
    return not any(servo.torque for servo in line.servos.values())


def all_on(line):
    return all(servo.torque for servo in line.servos.values())


def wait_until(condition, seconds=2.0):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.01)
    return condition()


def cycles(hand, count=20, period=0.005):
    for _ in range(count):
        hand.state()
        time.sleep(period)


def fresh(hand):
    """A state in which all joints answered; a busy test machine may starve the emulator."""
    for _ in range(4):
        state = hand.state()
        if not state.ages.any():
            break
    return state


def drive(hand, name, angle, count=100):
    """Steps of at most 0.2 rad towards an angle."""
    index = hand.joint_names.index(name)
    for _ in range(count):
        here = fresh(hand).positions[index]
        hand.command({name: here + np.clip(angle - here, -0.2, 0.2)})
        time.sleep(0.005)
    return fresh(hand).positions[index]


class TestConfigure:
    def test_modes_gains_caps_and_limits_are_written(self, hand, line, description):
        for joint in description.joints:
            servo = line.servos[joint.id]
            gains = [servo.get(f"position_{letter}_gain") for letter in "pid"]
            assert gains == ([1000, 0, 100] if joint.name.startswith("palm") else [400, 0, 400])
            assert servo.get("operating_mode") == 5
            cap = 750 if joint.name.startswith("palm") else 300
            assert servo.get("goal_current") == servo.get("current_limit") == cap
            assert servo.get("return_delay_time") == 0
            assert servo.get("profile_velocity") == 229

    def test_gains_and_caps_survive_a_change_of_mode(self, description, line):
        """The servo resets both when its mode changes, so the mode must come first."""
        with Hand(description, line.path) as hand:
            for mode in (3, 0, 4):
                with line.lock:
                    line.servos[13].set("operating_mode", mode)
                hand.configure()
                assert line.servos[13].get("operating_mode") == 5
                assert line.servos[13].get("position_p_gain") == 400
                assert line.servos[13].get("goal_current") == 300

    def test_eeprom_is_written_once_and_never_again(self, hand, line):
        written = [servo.eeprom_writes for servo in line.servos.values()]
        assert max(written) == 3  # return delay, mode, current limit
        hand.configure()
        hand.configure()
        assert [servo.eeprom_writes for servo in line.servos.values()] == written

    def test_what_another_program_left_is_put_right(self, description, line, caplog):
        servo = line.servos[13]
        servo.set("torque_enable", 1)
        servo.set("drive_mode", 8)  # a goal alone would turn torque on
        servo.set("homing_offset", 100)
        servo.set("bus_watchdog", -1)
        servo.set("status_return_level", 0)  # answers nothing but pings
        servo.set("position_i_gain", 77)
        with Hand(description, line.path) as hand:
            hand.configure()
        assert not servo.torque
        for name in ("drive_mode", "homing_offset", "bus_watchdog", "position_i_gain"):
            assert servo.get(name) == 0, name
        assert (
            "homing_offset, also after power off: index_proximal (servo 13) 100 -> 0" in caplog.text
        )

    def test_a_value_that_does_not_stay_is_named(self, description, line):
        servo = line.servos[13]
        servo._write = lambda name, count: None  # says yes, keeps nothing
        with Hand(description, line.path) as hand:
            with pytest.raises(
                ServoError, match=r"operating_mode did not.*servo 13\) has 3 instead"
            ):
                servo.set("return_delay_time", 0)
                hand.configure()

    def test_damaged_and_lost_packets_do_not_disturb_it(self, description, line):
        line.faults.drop = line.faults.corrupt = line.faults.truncate = 0.005
        line.faults.garbage = line.faults.duplicate = 0.05
        with Hand(description, line.path) as hand:
            hand.configure()
        for joint in description.joints:
            assert line.servos[joint.id].get("position_p_gain") == joint.gains.P

    def test_a_servo_with_a_hardware_error_is_named(self, description, line):
        line.servos[13].fail(OVERLOAD)
        with Hand(description, line.path) as hand:
            with pytest.raises(ServoError, match=r"index_proximal \(servo 13\) reports overload"):
                hand.configure()
            with pytest.raises(ServoError, match="configure"):
                hand.enable()
            hand.reboot(["index_proximal"])
            hand.configure()
            hand.enable()
            assert all_on(line)

    def test_a_reboot_is_followed_by_the_whole_configuration(self, hand, line):
        hand.reboot(["index_proximal"])
        assert line.servos[13].get("position_d_gain") == 0
        with pytest.raises(ServoError, match="configure"):
            hand.enable()
        hand.configure()
        assert line.servos[13].get("position_d_gain") == 400
        assert line.servos[13].get("goal_current") == 300


class TestConnect:
    def test_all_missing_and_strange_servos_are_listed(self, description, line):
        line.faults.silent = {11, 41}
        line.servos[51].set("model_number", 1190)
        with pytest.raises(BusError) as caught:
            Hand(description, line.path)
        text = str(caught.value)
        assert "no answer from index_distal (servo 11), ring_distal (servo 41)" in text
        assert "palm_inner (servo 51) is model 1190, the hand's file says XL330-M288-T" in text

    def test_the_wrong_rate_is_suspected_when_nobody_answers(self, description, line):
        slow = description.model_copy(update={"baud": 57600})
        with pytest.raises(BusError, match="no servo answers on .* at 57600 baud: .*baud rate"):
            Hand(slow, line.path)
        Hand(description, line.path).bus.close()  # and the port is free again

    def test_connecting_changes_no_torque(self, description, line):
        with Hand(description, line.path):
            assert all_off(line)

    def test_torque_that_another_program_left_on_goes_off_on_the_way_out(self, description, line):
        line.servos[13].set("torque_enable", 1)
        with Hand(description, line.path):
            pass
        assert all_off(line)


class TestEnable:
    def test_nothing_jumps(self, description):
        with ServoLineEmulator(joint.id for joint in description.joints) as line:
            for joint in description.joints:
                line.plant.place(joint.id, joint.ticks(0.3))
                line.servos[joint.id].set("goal_position", 2048)
            time.sleep(0.02)
            with Hand(description, line.path) as hand:
                hand.configure()
                hand.enable()
                cycles(hand)
                np.testing.assert_allclose(fresh(hand).positions, 0.3, atol=0.001)
                assert all_on(line)

    def test_a_joint_outside_its_limits_is_named_and_torque_stays_off(self, description, line):
        joint = description.joints[4]
        line.plant.place(joint.id, joint.ticks(-0.5))
        time.sleep(0.02)
        with Hand(description, line.path) as hand:
            hand.configure()
            with pytest.raises(ServoError, match=r"servo 13\) stands at -0.50 rad, limits -0.2"):
                hand.enable()
            assert all_off(line)

    def test_a_servo_that_does_not_take_torque_leaves_all_off(self, description, line):
        servo = line.servos[41]
        with Hand(description, line.path) as hand:
            hand.configure()
            write = servo.write
            servo.write = lambda at, data: 1 if (at, data) == (64, b"\x01") else write(at, data)
            with pytest.raises(ServoError, match=r"ring_distal \(servo 41\).*torque_enable := 1"):
                hand.enable()
            assert all_off(line)
            assert not hand.enabled


class TestState:
    def test_values_are_in_si_units_with_the_joints_signs(self, hand, line):
        line.plant.advance = lambda dt, drives: {}
        with line.lock:
            line.servos[13].set("present_position", 1024)
            line.servos[13].set("present_velocity", -10)
            line.servos[13].set("present_current", -150)
            line.servos[51].set("present_velocity", 10)
        state = fresh(hand)
        assert state.joint_names == hand.joint_names
        assert state.positions[4] == pytest.approx(math.pi / 2)
        assert state.velocities[4] == pytest.approx(10 * 0.229 / 60 * 2 * math.pi)
        assert state.currents[4] == pytest.approx(0.15)
        assert state.velocities[7] > 0
        np.testing.assert_allclose(state.voltages, 5.0)
        np.testing.assert_allclose(state.temperatures, 28.0)

    def test_the_stamp_is_in_the_middle_of_the_transaction(self, hand):
        before = time.monotonic()
        state = hand.state()
        after = time.monotonic()
        assert before < state.time < after
        assert (state.ages >= 0).all()

    def test_a_joint_that_does_not_answer_keeps_its_values_and_ages(self, hand, line):
        first = fresh(hand)
        line.faults.silent = {41}  # the last one asked
        time.sleep(0.05)
        second = hand.state()
        assert second.ages[-1] == pytest.approx(second.time - first.time)
        assert second.positions[-1] == first.positions[-1]
        line.faults.silent = set()
        assert fresh(hand).ages[-1] == 0

    def test_a_joint_that_never_answered_is_no_number(self, description, line):
        with Hand(description, line.path) as hand:
            line.faults.silent = {41}
            state = hand.state()
            assert np.isnan(state.positions[-1])
            assert np.isinf(state.ages[-1])
            line.faults.silent = set()


class TestCommand:
    def test_joints_go_where_they_are_told(self, hand, line):
        assert drive(hand, "index_proximal", 1.0) == pytest.approx(1.0, abs=0.01)
        assert line.servos[13].get("present_position") == pytest.approx(2048 - 652, abs=5)
        others = np.delete(fresh(hand).positions, 4)
        np.testing.assert_allclose(others, 0.0, atol=0.001)

    def test_one_command_moves_all_joints(self, hand, line):
        fresh(hand)
        hand.command(dict(zip(hand.joint_names, np.linspace(0.0, 0.14, 15), strict=True)))
        assert wait_until(lambda: line.servos[41].get("goal_position") == 2048 - 91)

    def test_a_wrong_command_is_refused_whole(self, hand, line):
        goals = [servo.get("goal_position") for servo in line.servos.values()]
        for positions, message in [
            ({"index_proximal": 1.6}, r"index_proximal \(servo 13\): 1.600 rad is outside -0.2"),
            ({"index_proximal": -0.21}, "outside"),
            ({"index_proximal": 0.36}, "0.36 rad from where it is; at most 0.35"),
            ({"index_proximal": math.nan}, "nan is no angle"),
            ({"index_proximal": math.inf}, "inf is no angle"),
            ({"little_finger": 0.1}, "no joints little_finger; there are: thumb_rotation"),
            ({"index_proximal": 0.1, "ring_distal": 2.0}, r"ring_distal \(servo 41\)"),
        ]:
            fresh(hand)
            with pytest.raises(CommandError, match=message):
                hand.command(positions)
        fresh(hand)  # answered after anything sent before it
        assert [servo.get("goal_position") for servo in line.servos.values()] == goals
        assert all_on(line)

    def test_all_mistakes_are_named_at_once(self, hand):
        fresh(hand)
        with pytest.raises(CommandError, match=r"servo 13.*; .*servo 41"):
            hand.command({"index_proximal": 1.0, "ring_distal": 2.0})

    def test_an_old_state_is_no_base_for_a_step(self, hand):
        fresh(hand)
        time.sleep(0.11)
        with pytest.raises(CommandError, match="its position is 0.1. s old; call state"):
            hand.command({"index_proximal": 0.1})
        fresh(hand)
        hand.command({"index_proximal": 0.1})

    def test_no_command_without_torque(self, hand):
        hand.state()
        hand.off()
        with pytest.raises(CommandError, match="torque is off: call enable"):
            hand.command({"index_proximal": 0.1})

    def test_it_works_under_faults_and_never_shows_a_wrong_angle(self, hand, line):
        line.faults.drop = line.faults.corrupt = line.faults.truncate = 0.003
        line.faults.garbage = line.faults.duplicate = 0.01
        line.faults.lost_instruction = 0.01
        angles = []
        for k in range(200):
            state = hand.state()
            angles.append(state.positions)
            if state.ages.max() < 0.05:
                hand.command(dict.fromkeys(hand.joint_names, 0.3 * math.sin(k / 20) ** 2))
            time.sleep(0.002)
        assert np.abs(np.diff(angles, axis=0)).max() < 0.2
        assert np.max(angles) == pytest.approx(0.3, abs=0.02)
        assert np.min(angles) >= -0.01


class TestTrouble:
    """Whatever happens: torque off, and a sentence that names the servo."""

    def test_an_overload_is_seen_in_the_same_cycle(self, hand, line):
        cycles(hand)
        with line.lock:
            line.servos[13].fail(OVERLOAD)
        start = time.monotonic()
        with pytest.raises(
            ServoError, match=r"index_proximal \(servo 13\) reports overload; torque is off"
        ):
            fresh(hand)
        assert time.monotonic() - start < 1.0
        assert all_off(line)
        assert not hand.enabled

    def test_several_errors_are_all_named(self, hand, line):
        with line.lock:
            line.servos[13].fail(1 << 5 | 1 << 2)
            line.servos[41].fail(1 << 0)
        with pytest.raises(ServoError) as caught:
            fresh(hand)
        assert "servo 13) reports overheating and overload" in str(caught.value)
        assert "servo 41) reports input voltage" in str(caught.value)
        assert all_off(line)

    def test_a_servo_that_stays_silent_is_named_after_five_cycles(self, hand, line):
        fresh(hand)
        line.faults.silent = {33}
        for _ in range(4):
            hand.state()
        with pytest.raises(TorqueError) as caught:
            hand.state()
        text = str(caught.value)
        assert "no answer from middle_proximal (servo 33) in 5 cycles" in text
        assert "it silenced middle_middle (servo 32)" in text
        assert "torque not confirmed off: cut the power!" in text
        others = [servo for i, servo in line.servos.items() if i != 33]
        assert not any(servo.torque for servo in others)

    def test_a_silent_servo_stops_by_its_own_watchdog(self, description, line):
        quick = description.model_copy(update={"watchdog": 0.2})
        with Hand(quick, line.path) as hand:
            hand.configure()
            hand.enable()
            line.faults.silent = {33}
            with pytest.raises(TorqueError):
                cycles(hand, 6, period=0)
            assert wait_until(lambda: line.servos[33].tripped)
            line.faults.silent = set()

    @pytest.mark.slow  # waits out every retry
    def test_damage_in_every_cycle_names_the_servos(self, hand, line):
        line.faults.corrupt = 1.0
        with pytest.raises(TorqueError, match=r"no answer from thumb_rotation.*cut the power"):
            cycles(hand, 6, period=0)
        assert all_off(line)  # the instructions arrived all the same

    def test_a_servo_that_is_there_but_cannot_be_read_is_not_called_absent(self, hand, line):
        cycles(hand)
        servo = line.servos[33]
        read = servo.read
        servo.read = lambda at, length: (1, b"") if length > 30 else read(at, length)
        with pytest.raises(
            ServoError, match="middle_proximal.*damaged or late in 5.*torque is off"
        ):
            cycles(hand, 6)
        assert all_off(line)

    def test_answers_of_an_earlier_cycle_cost_one_cycle_and_not_all_that_follow(self, hand, line):
        fresh(hand)
        with line.lock:
            late = b"".join(
                status(joint.id, *line.servos[joint.id].read(STATE.address, STATE.size))
                for joint in hand.description.joints
            )
        time.sleep(0.1)
        line.inject(late, delay=0.004)
        assert hand.state().ages.all()  # they are all there, and all old
        ages = [hand.state().ages for _ in range(3)]
        assert min(age.max() for age in ages) == 0.0

    def test_an_unplugged_adapter_is_noticed_at_once_and_the_watchdogs_act(self, description):
        quick = description.model_copy(update={"watchdog": 0.2})
        with ServoLineEmulator(joint.id for joint in description.joints) as line:
            with pytest.raises(TorqueError, match="cut the power") as caught:
                with Hand(quick, line.path) as hand:
                    hand.configure()
                    hand.enable()
                    hand.state()
                    line.unplug()
                    start = time.monotonic()
                    hand.state()
            assert time.monotonic() - start < 0.3
            text = str(caught.value)
            assert text.startswith(f"the servo port {line.path} failed")  # the cause comes first
            assert text.count("cut the power") == 1 and "all servos" in text
            time.sleep(TRIP)
            assert all(servo.tripped for servo in line.servos.values())

    def test_a_servo_that_restarts_by_itself_is_named(self, hand, line):
        cycles(hand)
        with line.lock:
            line.servos[13].reboot()
            line.servos[13]._booting = 0.0  # a dip so short that no cycle is missed
        with pytest.raises(ServoError, match=r"servo 13\) restarted by itself.*supply"):
            cycles(hand, 3)
        assert all_off(line)
        with pytest.raises(ServoError, match="configure"):  # its gains and cap are lost
            hand.enable()

    def test_goals_that_do_not_arrive_are_noticed(self, hand, line):
        with line.lock:
            line.servos[13].set("bus_watchdog", -1)
        with pytest.raises(ServoError, match=r"servo 13\) was stopped by its watchdog"):
            for k in range(10):
                fresh(hand)
                hand.command({"index_proximal": 0.01 * k})
        assert all_off(line)

    def test_one_lost_goal_is_no_trouble(self, hand, line):
        fresh(hand)
        line.faults.lost_instruction = 1.0
        hand.command({"index_proximal": 0.1})
        line.faults.lost_instruction = 0.0
        cycles(hand, 2)
        hand.command({"index_proximal": 0.1})
        cycles(hand, 5)

    def test_heat_warns_and_then_stops(self, hand, line, caplog):
        line.servos[13].temperature = 61.0
        cycles(hand, 5)
        warnings = [r for r in caplog.records if "61 degrees warm" in r.message]
        assert len(warnings) == 1
        line.servos[13].temperature = 69.0
        with pytest.raises(ServoError, match=r"servo 13\) is hotter than 68 degrees"):
            cycles(hand, 5)
        assert all_off(line)

    def test_after_trouble_the_hand_must_be_configured_again(self, hand, line):
        with line.lock:
            line.servos[13].fail(OVERLOAD)
        with pytest.raises(ServoError):
            fresh(hand)
        hand.reboot(["index_proximal"])
        hand.configure()
        hand.enable()
        cycles(hand)
        assert all_on(line)
        assert line.servos[13].get("goal_current") == 300


class TestOff:
    def test_an_exception_in_the_block_ends_torque(self, description, line):
        with pytest.raises(ZeroDivisionError):
            with Hand(description, line.path) as hand:
                hand.configure()
                hand.enable()
                assert all_on(line)
                _ = 1 / 0
        assert all_off(line)

    def test_lost_packets_do_not_keep_torque_on(self, hand, line):
        line.faults.drop = 0.2
        line.faults.lost_instruction = 0.2
        hand.off()
        line.faults.drop = line.faults.lost_instruction = 0.0
        assert all_off(line)

    def test_torque_that_cannot_be_confirmed_off_is_named(self, hand, line):
        line.faults.silent = {24}  # the first one asked: all others are silenced in a sync read
        with pytest.raises(TorqueError, match=r"cut the power! \(thumb_rotation \(servo 24\): "):
            hand.off()
        assert [i for i, servo in line.servos.items() if servo.torque] == [24]

    def test_a_signal_does_not_interrupt_it(self, hand, line, monkeypatch):
        turn_off = "hardware.servo.setup.turn_off"
        from hardware.servo import setup

        genuine, calls = setup.turn_off, []

        def interrupted(*arguments):
            calls.append(arguments)
            if len(calls) == 1:
                raise KeyboardInterrupt
            genuine(*arguments)

        monkeypatch.setattr(turn_off, interrupted)
        with pytest.raises(KeyboardInterrupt):
            hand.off()
        assert all_off(line)
