# SPDX-License-Identifier: MIT
"""Registers of servos on one line, by name and servo id.

The genuine Dynamixel SDK makes and checks the packets (header, stuffing, CRC); this layer asks and
answers in whole transactions, one at a time, and trusts no packet that does not fit the question:

- A status packet counts only with the right id and length. The SDK checks neither in its own
  ``read``: a late answer to an earlier question comes out as a value (DynamixelSDK pull request 665).
- After a transaction that did not end well the next one first waits until the line is quiet.
- A sync read gives a result for each servo; one that is silent or damaged hides no other.

``read``, ``write``, ``ping`` and ``reboot`` wait for the servo's answer; ``sync_write`` gets none.
``patience`` is how long to wait beyond the time the bytes need on the line [s]; ``attempts`` is how
often to ask in all. Nothing here prints, asks a person, or tries again without end.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass

from dynamixel_sdk import PacketHandler
from dynamixel_sdk.robotis_def import (
    BROADCAST_ID,
    COMM_SUCCESS,
    INST_PING,
    INST_READ,
    INST_REBOOT,
    INST_SYNC_READ,
    INST_SYNC_WRITE,
    INST_WRITE,
)

from hardware.serial_errors import PORT_ERRORS
from vtgtsam.exceptions import VtgtsamError

from .port import Port, why_not_open
from .replies import Reply, Traffic, in_order, parse
from .table import ALERT, STATUS_ERRORS, Block, decode, encode, register

_CYCLE_PATIENCE = 0.012  # [s], beyond the bytes' time; less is a false alarm under load
_PATIENCE = 0.2  # [s], outside the cycle nothing hurries


class BusError(VtgtsamError):
    """The port cannot be opened, is gone, or servos do not answer."""


class NoAnswerError(BusError):
    """A servo did not answer, or only with damaged packets."""


class TorqueError(BusError):
    """Torque may still be on: only the power switch helps."""


class ServoError(VtgtsamError):
    """A servo refused what it was told or is in trouble; no torque is on."""


@dataclass(frozen=True)
class Answer:
    """One servo's answer to a sync read.

    Attributes:
        values: Counts by register name.
        alert: Whether the servo reports a hardware error.
        arrived: Monotonic time when it came [s].
    """

    values: dict[str, int]
    alert: bool
    arrived: float


@dataclass(frozen=True)
class SyncRead:
    """What one sync read brought.

    Attributes:
        start: Monotonic time before the question was sent [s].
        end: Monotonic time after the last answer [s].
        answers: By servo id; only servos that answered well.
    """

    start: float
    end: float
    answers: dict[int, Answer]

    @property
    def time(self) -> float:
        """The middle of the transaction [s]."""
        return (self.start + self.end) / 2


class Bus:
    """The servo line on a serial port; a context manager that closes it.

    Args:
        path: The port, best by its name under /dev/serial/by-id.
        baud: The rate all servos are set to.
        names: What the servos are called in messages, by id.

    Raises:
        BusError: The port cannot be opened.
    """

    def __init__(self, path: str, baud: int, names: Mapping[int, str] | None = None) -> None:
        self.path = path
        self.baud = baud
        self.traffic = Traffic()
        self._names = dict(names or {})
        self._lock = threading.Lock()
        self._packets = PacketHandler(2.0)
        self._dirty = False  # bytes of an earlier transaction may still arrive
        try:
            self._port = Port(path, baud)
        except PORT_ERRORS as error:
            raise BusError(why_not_open(path, error)) from error

    def __enter__(self) -> Bus:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the port; every later call is a BusError."""
        with self._lock:
            self._port.closePort()

    def label(self, servo_id: int) -> str:
        """How messages call a servo."""
        name = self._names.get(servo_id)
        return f"servo {servo_id}" if name is None else f"{name} (servo {servo_id})"

    def ping(
        self, servo_id: int, attempts: int = 3, patience: float = _PATIENCE
    ) -> tuple[int, int]:
        """Model number and firmware version of a servo; NoAnswerError where it is silent."""
        data = self._ask(servo_id, INST_PING, b"", 3, attempts, patience)
        return decode("model_number", data[:2]), data[2]

    def read(self, servo_id: int, name: str, attempts: int = 3, patience: float = _PATIENCE) -> int:
        """Count in one register."""
        entry = register(name)
        question = _words(entry.address, entry.size)
        data = self._ask(servo_id, INST_READ, question, entry.size, attempts, patience)
        return decode(name, data)

    def write(
        self,
        servo_id: int,
        name: str,
        count: int,
        attempts: int = 3,
        patience: float = _PATIENCE,
    ) -> None:
        """Set one register and wait for the servo's word that it is set.

        Raises:
            ServoError: The servo refused.
        """
        order = _words(register(name).address) + encode(name, count)
        try:
            self._ask(servo_id, INST_WRITE, order, 0, attempts, patience)
        except ServoError as error:
            raise ServoError(f"{error} ({name} := {count})") from error

    def distrust(self) -> None:
        """Forget what is still on the way before the next question, for it may answer an older one."""
        self._dirty = True

    def reboot(self, servo_id: int) -> None:
        """Restart a servo. It is silent for some 0.3 s; everything in RAM is lost, torque is off."""
        self._ask(servo_id, INST_REBOOT, b"", 0, attempts=1, patience=_PATIENCE)

    def sync_write(self, name: str, counts: Mapping[int, int]) -> None:
        """Set one register of many servos at once. No servo answers: what is refused stays unseen."""
        entry = register(name)
        data = b"".join(bytes([i]) + encode(name, count) for i, count in counts.items())
        with self._transaction():
            self._send(BROADCAST_ID, INST_SYNC_WRITE, _words(entry.address, entry.size) + data)
            self._dirty = False

    def sync_read(
        self, ids: Sequence[int], block: Block, patience: float = _CYCLE_PATIENCE
    ) -> SyncRead:
        """Read registers of many servos at once, never asking twice.

        A servo that is silent costs the others nothing but time, except that real servos answer in
        turn: those asked after an absent one are silent as well.
        """
        with self._transaction():
            start = time.monotonic()
            question = _words(block.address, block.size) + bytes(ids)
            length = self._send(BROADCAST_ID, INST_SYNC_READ, question)
            self._port.expect(length + len(ids) * (11 + block.size), patience)
            arrived = self._collect(set(ids), block.size)
            end = time.monotonic()
            replies = in_order(arrived, ids)
            self._dirty = len(replies) < len(ids)
        for servo_id in ids:
            self.traffic.count(servo_id, answered=servo_id in replies, now=end)
        answers = {
            i: Answer(block.decode(reply.data), bool(reply.error & ALERT), reply.arrived)
            for i, reply in replies.items()
        }
        return SyncRead(start, end, answers)

    def _ask(
        self,
        servo_id: int,
        instruction: int,
        parameters: bytes,
        size: int,
        attempts: int,
        patience: float,
    ) -> bytes:
        """Ask one servo, up to ``attempts`` times, for an answer of ``size`` bytes."""
        for _ in range(attempts):
            with self._transaction():
                length = self._send(servo_id, instruction, parameters)
                self._port.expect(length + 11 + size, patience)
                reply = self._await(servo_id, size)
                self._dirty = reply is None
                now = time.monotonic()
            self.traffic.count(servo_id, answered=reply is not None, now=now)
            if reply is not None:
                if number := reply.error & ~ALERT:
                    what = STATUS_ERRORS.get(number, f"reports error {number}")
                    raise ServoError(f"{self.label(servo_id)} {what}")
                return reply.data
        raise NoAnswerError(
            f"{self.label(servo_id)} does not answer on {self.path} at {self.baud} baud"
        )

    @contextmanager
    def _transaction(self) -> Iterator[None]:
        """Own the line. Whatever interrupts the transaction, the next one finds it in order."""
        with self._lock:
            if not self._port.is_open:
                raise BusError(f"the port {self.path} is closed")
            try:
                if self._dirty:
                    self._port.drain()
                self._dirty = True
                yield
            except PORT_ERRORS as error:
                raise BusError(
                    f"the servo port {self.path} failed ({error}); check its cable and power"
                ) from error
            finally:
                self._port.is_using = False  # the SDK leaves it set after any exception

    def _send(self, servo_id: int, instruction: int, parameters: bytes) -> int:
        """Send an instruction packet and give its length; the SDK adds header, stuffing, CRC."""
        length = len(parameters) + 3
        packet = [0] * 4 + [servo_id, length & 0xFF, length >> 8, instruction, *parameters, 0, 0]
        if self._packets.txPacket(self._port, packet) != COMM_SUCCESS:
            raise OSError("the adapter did not take the packet")
        return len(packet)

    def _receive(self) -> Reply | None:
        """The next status packet, or None where none came whole."""
        raw, result = self._packets.rxPacket(self._port, False)
        if result == COMM_SUCCESS:
            return parse(raw, time.monotonic())
        self.traffic.damaged += bool(raw)
        return None

    def _await(self, servo_id: int, size: int) -> Reply | None:
        """One servo's answer of ``size`` bytes, or its refusal; others on the line are passed by."""
        while True:
            reply = self._receive()
            if reply is None:
                return None
            refused = bool(reply.error & ~ALERT) and not reply.data
            if reply.servo_id == servo_id and (refused or len(reply.data) == size):
                return reply
            self.traffic.foreign += 1

    def _collect(self, wanted: set[int], size: int) -> list[Reply]:
        """Status packets of ``size`` bytes until every wanted servo sent one or time is up."""
        arrived: list[Reply] = []
        missing = set(wanted)
        while missing and not self._port.isPacketTimeout():
            reply = self._receive()
            if reply is None:
                continue
            if reply.servo_id in wanted and len(reply.data) == size:
                arrived.append(reply)
                missing.discard(reply.servo_id)
            else:
                self.traffic.foreign += 1
        return arrived


def _words(*values: int) -> bytes:
    """Two bytes each, little-endian, as addresses and lengths go over the line."""
    return b"".join(value.to_bytes(2, "little") for value in values)
