# SPDX-License-Identifier: MIT
from __future__ import annotations

import math

import pytest

from hardware.servo.table import STATE, X330, Block, decode, encode, from_si, to_si


@pytest.mark.parametrize("name", [name for name, entry in X330.items() if entry.writable])
def test_counts_survive_the_way_to_bytes_and_back(name):
    entry = X330[name]
    counts = {entry.low, entry.high, *(c for c in (0, 1, -1) if entry.low <= c <= entry.high)}
    for count in counts:
        data = encode(name, count)
        assert len(data) == entry.size
        assert decode(name, data) == count


def test_negative_counts_are_a_twos_complement():
    assert encode("goal_current", -1) == b"\xff\xff"
    assert encode("goal_current", -100) == b"\x9c\xff"
    assert encode("goal_position", -2) == b"\xfe\xff\xff\xff"
    assert encode("bus_watchdog", -1) == b"\xff"
    assert decode("present_current", b"\x9c\xff") == -100
    assert decode("present_position", b"\x00\xf8\xff\xff") == -2048


def test_unsigned_registers_stay_positive():
    assert decode("realtime_tick", b"\xff\x7f") == 32767
    assert decode("model_number", b"\xff\xff") == 65535


@pytest.mark.parametrize(
    ("name", "count"),
    [("goal_current", 2353), ("position_p_gain", -1), ("position_p_gain", 400.5), ("led", True)],
)
def test_counts_out_of_range_are_refused(name, count):
    with pytest.raises(ValueError, match=f"{name} must be a whole number"):
        encode(name, count)


def test_read_only_and_unknown_registers_are_refused():
    with pytest.raises(ValueError, match="can only be read"):
        encode("present_position", 0)
    with pytest.raises(ValueError, match="alike: .*present_position"):
        decode("present_positon", b"")
    with pytest.raises(ValueError, match="4 bytes, got 2"):
        decode("present_position", b"ab")


def test_units_are_those_of_the_manual():
    assert to_si("present_position", 4096) == pytest.approx(2 * math.pi)
    assert to_si("present_velocity", 1) == pytest.approx(0.229 / 60 * 2 * math.pi)
    assert to_si("present_current", 300) == pytest.approx(0.3)
    assert to_si("present_input_voltage", 50) == pytest.approx(5.0)
    assert to_si("return_delay_time", 250) == pytest.approx(500e-6)
    assert from_si("bus_watchdog", 0.2) == 10
    assert from_si("profile_velocity", 5.5) == 229  # as the public ISyHand driver rounds it


def test_a_block_is_cut_at_the_registers():
    block = Block(["present_current", "present_velocity", "present_position"])
    assert (block.address, block.size) == (126, 10)
    data = bytes.fromhex("ffff fdffffff 00080000")
    assert block.decode(data) == {
        "present_current": -1,
        "present_velocity": -3,
        "present_position": 2048,
    }


def test_a_block_reads_over_what_lies_between_its_registers():
    block = Block(["torque_enable", "hardware_error_status", "bus_watchdog"])
    data = bytearray(block.size)
    data[0], data[6], data[34] = 1, 32, 0xFF
    assert block.decode(bytes(data)) == {
        "torque_enable": 1, "hardware_error_status": 32, "bus_watchdog": -1,
    }  # fmt: skip
    with pytest.raises(ValueError, match="order of addresses, torque_enable is not"):
        Block(["bus_watchdog", "torque_enable"])


def test_the_cycle_reads_one_piece_from_the_goal_to_the_temperature():
    assert (STATE.address, STATE.size) == (116, 31)
