# SPDX-License-Identifier: MIT
"""Packets of DYNAMIXEL Protocol 2.0, written apart from the SDK so that each checks the other.

Source: ROBOTIS e-manual, "DYNAMIXEL Protocol 2.0", https://emanual.robotis.com/docs/en/dxl/protocol2/ .

    FF FF FD 00 | id | length (2 bytes) | instruction | parameters | CRC (2 bytes)

``length`` counts what follows it. The CRC covers all before it. Where instruction and parameters
contain FF FF FD, another FD is put behind (stuffing), so that only a header looks like a header.
"""

from __future__ import annotations

from dataclasses import dataclass
from enum import IntEnum

from fastcrc import crc16

HEADER = b"\xff\xff\xfd\x00"
BROADCAST = 0xFE

_LONGEST = 1024  # [bytes], a length beyond is a damaged one


class Instruction(IntEnum):
    """What a packet's instruction byte means."""

    PING = 0x01
    READ = 0x02
    WRITE = 0x03
    REBOOT = 0x08
    STATUS = 0x55
    SYNC_READ = 0x82
    SYNC_WRITE = 0x83


@dataclass(frozen=True)
class Packet:
    """An instruction or status packet without header, stuffing and CRC."""

    servo_id: int
    instruction: int
    parameters: bytes = b""


def pack(packet: Packet) -> bytes:
    """A packet's bytes on the line."""
    body = stuff(bytes([packet.instruction]) + packet.parameters)
    head = HEADER + bytes([packet.servo_id]) + (len(body) + 2).to_bytes(2, "little")
    return head + body + crc16.umts(head + body).to_bytes(2, "little")


def status(servo_id: int, error: int, data: bytes = b"") -> bytes:
    """A status packet's bytes on the line."""
    return pack(Packet(servo_id, Instruction.STATUS, bytes([error]) + data))


def stuff(body: bytes) -> bytes:
    """Put an FD behind every FF FF FD."""
    return body.replace(b"\xff\xff\xfd", b"\xff\xff\xfd\xfd")


def unstuff(body: bytes) -> bytes:
    """Undo ``stuff``."""
    return body.replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")


class Decoder:
    """Finds packets in a stream of bytes, whatever else is in it.

    Attributes:
        damaged: Packets thrown away because of their CRC.
    """

    def __init__(self) -> None:
        self.damaged = 0
        self._buffer = bytearray()

    def reset(self) -> None:
        """Forget the beginning of a packet, as a line does that was quiet for long."""
        self._buffer.clear()

    def feed(self, data: bytes) -> list[Packet]:
        """The packets that ``data`` completes."""
        self._buffer += data
        packets = []
        while (packet := self._next()) is not None:
            if isinstance(packet, Packet):
                packets.append(packet)
        return packets

    def _next(self) -> Packet | bool | None:
        """A packet, or True where some bytes were thrown away, or None where more are needed."""
        start = self._buffer.find(HEADER)
        if start < 0:
            del self._buffer[: max(len(self._buffer) - len(HEADER) + 1, 0)]
            return None
        del self._buffer[:start]
        if len(self._buffer) < 7:
            return None
        length = int.from_bytes(self._buffer[5:7], "little")
        if not 3 <= length <= _LONGEST:
            return self._skip()
        if len(self._buffer) < 7 + length:
            return None
        raw = bytes(self._buffer[: 7 + length])
        if crc16.umts(raw[:-2]) != int.from_bytes(raw[-2:], "little"):
            self.damaged += 1
            return self._skip()
        del self._buffer[: 7 + length]
        body = unstuff(raw[7:-2])
        return Packet(raw[4], body[0], body[1:])

    def _skip(self) -> bool:
        del self._buffer[: len(HEADER)]
        return True
