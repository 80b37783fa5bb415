# SPDX-License-Identifier: MIT
"""Three clients read the same numbers: the genuine SDK, rustypot, and our own bus."""

from __future__ import annotations

import math
import random
from contextlib import closing

import dynamixel_sdk as sdk
import pytest

from hardware.emulate.servos import ServoLineEmulator
from hardware.servo.bus import Bus
from hardware.servo.table import MODELS, X330, Block, encode

BAUD = 1_000_000
MODEL = MODELS["XL330-M288-T"].number
IDS = [11, 12, 21, 52]
MOTION = Block(["present_current", "present_velocity", "present_position"])


@pytest.fixture
def line():
    """Servos that hold random numbers in every register a client may see."""
    rng = random.Random(0)
    with ServoLineEmulator(IDS, BAUD, plant=Still()) as emulator:
        for servo in emulator.servos.values():
            servo.advance = lambda dt: None
            for name in ("position_p_gain", "goal_current", "goal_position", "homing_offset"):
                servo.set(name, rng.randint(X330[name].low, X330[name].high))
            for name in MOTION.names:
                servo.set(name, rng.randint(-5000, 5000))
        # -1 before -3 puts FF FF FD into the data, which must be stuffed.
        emulator.servos[12].set("present_current", -1)
        emulator.servos[12].set("present_velocity", -3)
        yield emulator


class Still:
    """Motors that leave the servos' registers alone."""

    def advance(self, dt, drives):
        return {}


@pytest.fixture
def sdk_client(line):
    port, packets = sdk.PortHandler(line.path), sdk.PacketHandler(2.0)
    assert port.setBaudRate(BAUD)
    with closing(port.ser):
        yield port, packets


@pytest.fixture
def rusty(line):
    rustypot = pytest.importorskip("rustypot")
    client = rustypot.Xl330PyController(line.path, BAUD, 0.5)
    yield client
    client.close()


def truth(line, name):
    return [line.servos[i].get(name) for i in IDS]


def insist(call, *arguments, attempts=20):
    """Call the SDK again where it timed out.

    Its reads spin, and here the emulator lives in the same process: the interpreter lock may keep
    an answer back for longer than the SDK waits.
    """
    for _ in range(attempts):
        answer = call(*arguments)
        result = answer[-2] if isinstance(answer, tuple) else answer
        if result not in (sdk.COMM_RX_TIMEOUT, sdk.COMM_RX_CORRUPT):
            break
    return answer


def sdk_read(client, servo_id, name):
    port, packets = client
    entry = X330[name]
    read = {1: packets.read1ByteTxRx, 2: packets.read2ByteTxRx, 4: packets.read4ByteTxRx}
    count, result, error = insist(read[entry.size], port, servo_id, entry.address)
    assert (result, error) == (sdk.COMM_SUCCESS, 0)
    return count - (1 << 8 * entry.size) * (entry.signed and count >> (8 * entry.size - 1))


def test_the_sdk_reads_what_the_servos_hold(line, sdk_client):
    for name in X330:
        assert [sdk_read(sdk_client, i, name) for i in IDS] == truth(line, name), name


def test_rustypot_reads_what_the_servos_hold(line, rusty):
    for name, entry in X330.items():
        for servo_id in IDS:
            data, error = rusty.read_raw_data_with_error(servo_id, entry.address, entry.size)
            count = line.servos[servo_id].get(name)
            assert bytes(data) == count.to_bytes(entry.size, "little", signed=entry.signed), name
            assert error == 0


def test_our_bus_reads_what_the_servos_hold(line):
    with Bus(line.path, BAUD) as bus:
        for name in X330:
            assert [bus.read(i, name, attempts=20) for i in IDS] == truth(line, name), name
        answers = next(a for _ in range(20) if len(a := bus.sync_read(IDS, MOTION).answers) == 4)
    for name in MOTION.names:
        assert [answers[i].values[name] for i in IDS] == truth(line, name)


def test_rustypot_reads_positions_in_radians(line, rusty):
    expected = [(p - 2048) * 2 * math.pi / 4096 for p in truth(line, "present_position")]
    assert rusty.sync_read_present_position(IDS) == pytest.approx(expected)


def test_group_reads_of_both_clients_agree(line):
    port, packets = sdk.PortHandler(line.path), sdk.PacketHandler(2.0)
    port.setBaudRate(BAUD)
    with closing(port.ser):
        group = sdk.GroupSyncRead(port, packets, 132, 4)
        for servo_id in IDS:
            group.addParam(servo_id)
        assert insist(group.txRxPacket) == sdk.COMM_SUCCESS
        ours = [group.getData(servo_id, 132, 4) for servo_id in IDS]
    expected = [p % (1 << 32) for p in truth(line, "present_position")]
    assert ours == expected
    rustypot = pytest.importorskip("rustypot")
    rusty = rustypot.Xl330PyController(line.path, BAUD, 0.5)
    with closing(rusty):
        raw = rusty.sync_read_raw_data(IDS, 132, 4)
    assert [int.from_bytes(bytes(data), "little") for data in raw] == expected


def test_all_clients_find_the_servos(line, sdk_client):
    port, packets = sdk_client
    found, result = packets.broadcastPing(port)
    assert result == sdk.COMM_SUCCESS
    assert {i: model for i, (model, _) in found.items()} == dict.fromkeys(IDS, MODEL)
    assert insist(packets.ping, port, 11) == (MODEL, sdk.COMM_SUCCESS, 0)
    assert packets.ping(port, 99)[1] == sdk.COMM_RX_TIMEOUT


def test_rustypot_finds_the_servos_and_sees_alerts(line, rusty):
    found = next(f for _ in range(20) if len(f := rusty.scan([*IDS, 99])) == len(IDS))
    assert found == dict.fromkeys(IDS, MODEL)
    line.servos[21].fail(1 << 5)
    _, error = rusty.read_register_with_error(21, "present_temperature")
    assert error == 0x80
    assert rusty.read_register(21, "hardware_error_status") == 1 << 5


def test_what_one_client_writes_another_reads(line, sdk_client):
    port, packets = sdk_client
    for count in (-1, -100, 1750):
        raw = int.from_bytes(encode("goal_current", count), "little")
        assert insist(packets.write2ByteTxRx, port, 11, 102, raw) == (sdk.COMM_SUCCESS, 0)
        assert sdk_read(sdk_client, 11, "goal_current") == count
        assert line.servos[11].get("goal_current") == count


def test_the_sdk_sees_refusals(line, sdk_client):
    port, packets = sdk_client

    def error(write, address, count):
        result, error = insist(write, port, 11, address, count)
        assert result == sdk.COMM_SUCCESS
        return error

    assert error(packets.write1ByteTxRx, 64, 1) == 0
    assert error(packets.write1ByteTxRx, 11, 5) == 7
    assert error(packets.write1ByteTxRx, 64, 2) == 4
    assert error(packets.write2ByteTxRx, 116, 2) == 5


def test_an_absent_servo_silences_those_asked_after_it(line, sdk_client):
    port, packets = sdk_client
    group = sdk.GroupSyncRead(port, packets, 132, 4)
    for servo_id in (11, 99, 12):
        group.addParam(servo_id)
    assert group.txRxPacket() == sdk.COMM_RX_TIMEOUT
    with Bus(line.path, BAUD) as bus:
        answers = next(a for _ in range(20) if (a := bus.sync_read([11, 99, 12], MOTION).answers))
        assert list(answers) == [11]
