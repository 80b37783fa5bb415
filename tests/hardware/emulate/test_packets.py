# SPDX-License-Identifier: MIT
"""Packets printed in the manual, and streams with anything in them."""

from __future__ import annotations

import random

import pytest
from hypothesis import given
from hypothesis import strategies as st

from hardware.emulate.packets import BROADCAST, Decoder, Instruction, Packet, pack, status

# ROBOTIS e-manual, "DYNAMIXEL Protocol 2.0", the examples of each instruction.
PRINTED = {
    "ping": (Packet(1, Instruction.PING), "01 0300 01 194e"),
    "broadcast ping": (Packet(BROADCAST, Instruction.PING), "fe 0300 01 3142"),
    "read": (Packet(1, Instruction.READ, b"\x84\0\x04\0"), "01 0700 02 84000400 1d15"),
    "write": (
        Packet(1, Instruction.WRITE, b"\x74\0\0\x02\0\0"),
        "01 0900 03 740000020000 ca89",
    ),
    "reboot": (Packet(1, Instruction.REBOOT), "01 0300 08 2f4e"),
    "sync read": (
        Packet(BROADCAST, Instruction.SYNC_READ, b"\x84\0\x04\0\x01\x02"),
        "fe 0900 82 840004000102 cefa",
    ),
    "sync write": (
        Packet(BROADCAST, Instruction.SYNC_WRITE, bytes.fromhex("74000400 0196000000 02aa000000")),
        "fe 1100 83 74000400 0196000000 02aa000000 8287",
    ),
    "status": (Packet(1, Instruction.STATUS, b"\0\x06\x04\x26"), "01 0700 55 00 060426 655d"),
}


@pytest.mark.parametrize("name", PRINTED)
def test_packets_are_those_of_the_manual(name):
    packet, printed = PRINTED[name]
    line = bytes.fromhex("fffffd00" + printed)
    assert pack(packet) == line
    assert Decoder().feed(line) == [packet]


def test_status_packets_are_those_of_the_manual():
    assert status(2, 0, b"\x1f\x08\0\0") == bytes.fromhex("fffffd00 02 0800 55 00 1f080000 babe")


def test_a_header_in_the_data_is_stuffed():
    line = status(1, 0, b"\xff\xff\xfd\xff")  # current -1, then velocity -3
    assert line[5] == 4 + 4 + 1
    assert b"\xff\xff\xfd\xfd\xff" in line
    assert Decoder().feed(line) == [Packet(1, Instruction.STATUS, b"\0\xff\xff\xfd\xff")]


@given(st.lists(st.sampled_from([0xFF, 0xFD, 0x00, 0x55]), max_size=12))
def test_any_data_survives_stuffing(data):
    packet = Packet(7, Instruction.WRITE, bytes(data))
    assert Decoder().feed(pack(packet)) == [packet]


def test_packets_are_found_in_pieces_and_between_noise():
    rng = random.Random(1)
    packets = [Packet(i % 250, Instruction.READ, rng.randbytes(i % 9)) for i in range(200)]
    stream = b"".join(rng.randbytes(i % 4) + pack(p) for i, p in enumerate(packets))
    decoder, found = Decoder(), []
    while stream:
        size = rng.randint(1, 12)
        found += decoder.feed(stream[:size])
        stream = stream[size:]
    assert found == packets


def test_a_flipped_bit_is_always_noticed():
    line = pack(Packet(1, Instruction.WRITE, b"\x74\0\0\x02\0\0"))
    for bit in range(8 * len(line)):
        broken = bytearray(line)
        broken[bit // 8] ^= 1 << bit % 8
        assert Decoder().feed(bytes(broken)) == []
