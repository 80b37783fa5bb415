# SPDX-License-Identifier: MIT
"""The control table against two others: the SDK's model file and rustypot's registers."""

from __future__ import annotations

import importlib.resources

import pytest

from hardware.servo.table import BAUD_CODES, MODELS, X330, Model


def model_file():
    path = importlib.resources.files("dynamixel_easy_sdk") / "control_table/xl330_m288_fw52.model"
    rows = path.read_text().split("Data Name")[-1].split("\n")[1:]
    for row in filter(None, rows):
        address, size, name = row.split("\t")
        yield (
            name.strip().lower().replace("(shadow)", "").replace(" ", "_"),
            int(address),
            int(size),
        )


def test_addresses_and_sizes_are_those_of_the_sdks_model_file():
    theirs = {name: (address, size) for name, address, size in model_file()}
    ours = {name: (entry.address, entry.size) for name, entry in X330.items()}
    shared = ours.keys() & theirs.keys()
    assert len(shared) == len(X330) - 2
    assert {name: ours[name] for name in shared} == {name: theirs[name] for name in shared}
    assert ours.keys() - shared == {"startup_configuration", "backup_ready"}  # newer firmware


def test_addresses_sizes_and_signs_are_those_of_rustypot():
    rustypot = pytest.importorskip("rustypot")
    registers = {r.name: r for r in rustypot.Xl330PyController.registers()}
    assert X330.keys() <= registers.keys()
    for name, entry in X330.items():
        assert (entry.address, entry.size) == (registers[name].addr, registers[name].size), name


def test_registers_do_not_overlap():
    ends = [(entry.address, entry.address + entry.size) for entry in X330.values()]
    assert all(end <= start for (_, end), (start, _) in zip(ends, ends[1:], strict=False))


def test_numbers_of_the_manual():
    assert MODELS["XL330-M288-T"] == Model(1200, 1750, (4.5, 5.5))
    assert MODELS["XC330-M288-T"] == Model(1240, 2352, (4.5, 5.5))
    assert BAUD_CODES == {
        9600: 0, 57600: 1, 115200: 2, 1000000: 3, 2000000: 4, 3000000: 5, 4000000: 6,
    }  # fmt: skip
    assert X330["operating_mode"].initial == 3
    assert X330["position_p_gain"].address == 84
    assert X330["position_d_gain"].address == 80
    assert X330["current_limit"].high == 2352
    assert X330["shutdown"].initial == 53
    assert X330["goal_position"].high == 1_048_575
    signed = {name for name, entry in X330.items() if entry.signed}
    assert signed == {
        "homing_offset", "bus_watchdog", "goal_pwm", "goal_current", "goal_velocity",
        "goal_position", "present_pwm", "present_current", "present_velocity", "present_position",
        "velocity_trajectory", "position_trajectory",
    }  # fmt: skip
    assert {name for name, e in X330.items() if e.eeprom and e.writable} >= {"id", "shutdown"}
    assert not X330["torque_enable"].eeprom
