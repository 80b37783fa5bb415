# SPDX-License-Identifier: MIT
"""The rules of a servo, as the manual has them, without a line and without waiting."""

from __future__ import annotations

import pytest

from hardware.emulate.motor import FreeMotors
from hardware.emulate.servo import (
    ACCESS,
    BOOT_TIME,
    LENGTH,
    LIMIT,
    OVERHEATING,
    OVERLOAD,
    RANGE,
    EmulatedServo,
)
from hardware.servo.table import X330, encode


@pytest.fixture
def servo():
    return EmulatedServo(1)


def write(servo, name, count):
    return servo.write(X330[name].address, encode(name, count))


def run(servo, seconds, plant=None, dt=0.005):
    plant = plant or FreeMotors()
    for _ in range(round(seconds / dt)):
        servo.advance(dt)
        servo.observe(plant.advance(dt, {1: servo.drive()})[1])


def in_mode_5(servo, cap=300, gain=400):
    for name, count in {
        "operating_mode": 5,
        "position_p_gain": gain,
        "goal_current": cap,
        "torque_enable": 1,
    }.items():
        assert write(servo, name, count) == 0


def test_eeprom_is_locked_under_torque(servo):
    assert write(servo, "torque_enable", 1) == 0
    assert write(servo, "operating_mode", 5) == ACCESS
    assert servo.eeprom_writes == 0
    assert write(servo, "torque_enable", 0) == 0
    assert write(servo, "operating_mode", 5) == 0
    assert servo.eeprom_writes == 1


def test_a_change_of_mode_resets_gains_and_cap(servo):
    write(servo, "position_p_gain", 123)
    write(servo, "goal_current", 300)
    write(servo, "profile_velocity", 50)
    write(servo, "operating_mode", 5)
    assert servo.get("position_p_gain") != 123
    assert servo.get("goal_current") == 1750
    assert servo.get("profile_velocity") == 0


def test_writes_are_refused_as_the_manual_says(servo):
    assert servo.write(126, b"\0\0") == ACCESS  # present current can only be read
    assert servo.write(117, b"\0") == ACCESS  # inside goal position
    assert servo.write(116, b"\0\0") == LENGTH
    assert servo.write(64, b"\x02") == RANGE
    write(servo, "current_limit", 500)
    assert write(servo, "goal_current", 501) == LIMIT
    assert write(servo, "goal_position", 4096) == LIMIT  # in position mode
    assert write(servo, "operating_mode", 5) == 0
    assert write(servo, "goal_position", 4096) == 0  # in mode 5 the limits do not count


def test_a_write_over_several_registers_is_whole_or_not_at_all(servo):
    assert servo.write(80, b"\x01\0\x02\0\x03\0") == 0
    assert [servo.get(f"position_{g}_gain") for g in "dip"] == [1, 2, 3]
    assert servo.write(80, b"\x09\0\x09\0\xff\xff") == RANGE
    assert [servo.get(f"position_{g}_gain") for g in "dip"] == [1, 2, 3]


def test_a_motor_goes_to_its_goal_at_the_profiles_speed(servo):
    in_mode_5(servo)
    write(servo, "profile_velocity", 100)  # 1563 ticks/s
    write(servo, "goal_position", 3048)
    run(servo, 0.2, plant := FreeMotors())
    assert servo.get("present_position") == pytest.approx(2048 + 0.2 * 1563, abs=20)
    assert servo.get("present_velocity") == pytest.approx(100, abs=2)
    run(servo, 2.0, plant)
    assert servo.get("present_position") == pytest.approx(3048, abs=1)


def test_without_torque_nothing_moves(servo):
    write(servo, "goal_position", 3000)
    run(servo, 1.0)
    assert servo.get("present_position") == 2048


def test_the_watchdog_stops_a_servo_that_hears_nothing(servo):
    in_mode_5(servo)
    write(servo, "bus_watchdog", 10)  # 0.2 s
    write(servo, "profile_velocity", 100)
    write(servo, "goal_position", 4000)
    plant = FreeMotors()
    run(servo, 0.15, plant)
    servo.heard()
    run(servo, 0.19, plant)
    assert not servo.tripped
    run(servo, 0.02, plant)
    assert servo.tripped
    where = servo.get("present_position")
    run(servo, 1.0, plant)
    assert servo.get("present_position") == pytest.approx(where, abs=20)
    assert write(servo, "goal_position", 2048) == RANGE
    assert write(servo, "bus_watchdog", 0) == 0
    assert write(servo, "goal_position", 2048) == 0


def test_the_watchdog_sleeps_while_torque_is_off(servo):
    write(servo, "bus_watchdog", 10)
    run(servo, 1.0)
    assert not servo.tripped


def test_a_capped_current_holds_an_obstacle_without_overload(servo):
    in_mode_5(servo, cap=300)
    write(servo, "goal_position", 3000)
    run(servo, 5.0, FreeMotors(obstacles={1: 2200.0}))
    assert servo.get("present_position") == 2200
    assert servo.get("present_current") == 300
    assert servo.torque
    assert not servo.alert


def test_full_current_against_an_obstacle_is_an_overload_that_only_a_reboot_ends(servo):
    in_mode_5(servo, cap=1750)
    write(servo, "goal_position", 3000)
    run(servo, 2.0, FreeMotors(obstacles={1: 2200.0}))
    assert servo.get("hardware_error_status") == OVERLOAD
    assert not servo.torque
    assert write(servo, "torque_enable", 1) != 0
    servo.reboot()
    assert servo.booting
    run(servo, BOOT_TIME + 0.01)
    assert not servo.booting
    assert not servo.alert
    assert write(servo, "torque_enable", 1) == 0


def test_heat_shuts_down(servo):
    in_mode_5(servo)
    servo.temperature = 71.0
    run(servo, 0.01)
    assert servo.get("hardware_error_status") == OVERHEATING
    assert not servo.torque


def test_a_fault_outside_the_shutdown_mask_only_raises_the_alert(servo):
    write(servo, "shutdown", 0)
    write(servo, "torque_enable", 1)
    servo.fail(OVERLOAD)
    assert servo.torque
    assert servo.alert == 0x80


def test_a_reboot_forgets_ram_and_keeps_eeprom(servo):
    in_mode_5(servo)
    servo.reboot()
    assert servo.get("operating_mode") == 5
    assert servo.get("position_p_gain") == 400
    assert servo.get("goal_current") == 1750
    assert not servo.torque
    run(servo, 0.1)
    assert servo.get("realtime_tick") == pytest.approx(100, abs=2)


def test_drive_mode_8_turns_torque_on_with_a_goal(servo):
    write(servo, "drive_mode", 8)
    write(servo, "goal_position", 2100)
    assert servo.torque


def test_the_clock_counts_milliseconds(servo):
    before = servo.get("realtime_tick")
    run(servo, 1.0)
    assert (servo.get("realtime_tick") - before) % 32768 == pytest.approx(1000, abs=2)
