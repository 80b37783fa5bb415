# SPDX-License-Identifier: MIT
from __future__ import annotations

import os
import time
import tty

import pytest
from dynamixel_sdk import COMM_RX_CORRUPT, COMM_RX_TIMEOUT, COMM_SUCCESS, PacketHandler

from hardware.emulate.packets import status
from hardware.serial_errors import PORT_ERRORS
from hardware.servo.port import Port, latency_timer


@pytest.fixture
def wire():
    """The far end of a port."""
    master, slave = os.openpty()
    tty.setraw(slave)
    yield master, os.ttyname(slave)
    os.close(slave)
    os.close(master)


@pytest.fixture
def port(wire):
    port = Port(wire[1], 1_000_000)
    yield port
    port.closePort()


def receive(port, patience):
    port.expect(0, patience)
    start = time.monotonic()
    _, result = PacketHandler(2.0).rxPacket(port, False)
    return result, time.monotonic() - start


def test_silence_ends_at_the_deadline(port):
    result, seconds = receive(port, 0.05)
    assert result == COMM_RX_TIMEOUT
    assert 0.05 <= seconds < 0.1


def test_waiting_does_not_spin(port):
    before = time.process_time()
    receive(port, 0.5)
    assert time.process_time() - before < 0.2


def test_bytes_that_already_lie_there_are_read_after_the_deadline(wire, port):
    os.write(wire[0], status(1, 0, b"abc"))
    time.sleep(0.01)
    port.expect(0, 0.0)
    assert PacketHandler(2.0).rxPacket(port, False)[1] == COMM_SUCCESS


def test_it_is_not_too_late_while_bytes_wait(wire, port):
    os.write(wire[0], b"x")
    time.sleep(0.01)
    port.expect(0, 0.0)
    assert not port.isPacketTimeout()
    port.readPort(1)
    assert port.isPacketTimeout()


def test_half_a_packet_ends_at_the_deadline(wire, port):
    os.write(wire[0], status(1, 0, b"abc")[:-4])
    result, seconds = receive(port, 0.03)
    assert result == COMM_RX_CORRUPT
    assert seconds < 0.1


class Babble:
    """A serial port on which bytes never end."""

    in_waiting = 5

    def read(self, length):
        time.sleep(0.0001)
        return (b"\xff\xff\xfd\x00\x01\x55noise" * 100)[:length]


def test_noise_without_end_ends_the_wait(port, monkeypatch):
    monkeypatch.setattr(port, "ser", Babble())
    result, seconds = receive(port, 0.02)
    assert result == COMM_RX_CORRUPT
    assert 0.02 < seconds < 1.0
    with pytest.raises(OSError, match="never falls silent"):
        port.drain()


def test_draining_ends_when_the_line_is_quiet(wire, port):
    os.write(wire[0], b"late")
    start = time.monotonic()
    port.drain()
    assert 0.01 <= time.monotonic() - start < 0.1
    assert port.getBytesAvailable() == 0
    start = time.monotonic()
    port.drain()  # still quiet
    assert time.monotonic() - start < 0.005


def test_a_second_program_cannot_open_the_port(wire, port):
    with pytest.raises(PORT_ERRORS):
        Port(wire[1], 1_000_000)


def test_a_rate_the_sdk_does_not_know_is_refused(wire):
    with pytest.raises(ValueError, match="cannot set 123 baud"):
        Port(wire[1], 123)


def test_an_adapter_that_keeps_bytes_back_gets_more_time_and_a_warning(wire, monkeypatch, caplog):
    assert latency_timer(wire[1]) is None
    monkeypatch.setattr("hardware.servo.port.latency_timer", lambda path: 0.016)
    port = Port(wire[1], 1_000_000)
    try:
        assert "keeps bytes back for 16 ms" in caplog.text
        _, seconds = receive(port, 0.012)
        assert seconds >= 0.028
    finally:
        port.closePort()
