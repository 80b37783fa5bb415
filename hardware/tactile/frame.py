# SPDX-License-Identifier: MIT
"""The pad board's frames: one set of readings each, so framed that damage is always noticed.

On the wire a frame is COBS(payload) and a zero byte; the payload is, least significant byte first,

    version u8 | type u8 | sequence u16 | board time [us] u32 | n u8 | n x reading u16 | CRC-16

COBS leaves no zero inside, so a reader finds the next frame after any damage. The checksum is
CRC-16/IBM-3740 (polynomial 0x1021, start 0xFFFF) over all that precedes it. 16 readings make 45
bytes. ``firmware/pad_board/pad_frame.h`` is the same format in C.
"""

from __future__ import annotations

import struct
from dataclasses import dataclass

from cobs import cobs
from fastcrc import crc16

from vtgtsam.exceptions import VtgtsamError

VERSION = 1
READINGS = 1  # the only type of frame so far; others are left for later boards
FULL_SCALE = 0xFFFF  # a reading of the whole supply voltage, whatever the board's converter

_HEADER = struct.Struct("<BBHIB")
_LONGEST = 600  # [bytes], above the longest frame: 255 readings


class FrameError(VtgtsamError):
    """Bytes that are not a whole, undamaged frame."""


class FrameVersionError(FrameError):
    """An undamaged frame in a version of the format that this program does not know."""


@dataclass(frozen=True)
class Frame:
    """One set of readings.

    Attributes:
        sequence: Counts the board's frames, modulo 2^16.
        board_time_us: The board's clock when it read the pads [us], modulo 2^32.
        readings: One value an input, ``FULL_SCALE`` being the supply voltage.
        kind: Type of the frame.
    """

    sequence: int
    board_time_us: int
    readings: tuple[int, ...]
    kind: int = READINGS


def encode(frame: Frame) -> bytes:
    """The frame's bytes on the wire, with the zero that ends it."""
    count = len(frame.readings)
    header = _HEADER.pack(VERSION, frame.kind, frame.sequence, frame.board_time_us, count)
    payload = header + struct.pack(f"<{count}H", *frame.readings)
    packet: bytes = cobs.encode(payload + struct.pack("<H", crc16.ibm_3740(payload)))
    return packet + b"\0"


def decode(packet: bytes) -> Frame:
    """The frame in the bytes between two zeros.

    Raises:
        FrameError: The bytes are damaged.
        FrameVersionError: They are whole, but of another version of the format.
    """
    try:
        payload = cobs.decode(packet)
    except cobs.DecodeError as error:
        raise FrameError(f"not COBS: {error}") from error
    if len(payload) < _HEADER.size + 2:
        raise FrameError(f"{len(payload)} bytes are too few for a frame")
    body, checksum = payload[:-2], int.from_bytes(payload[-2:], "little")
    if crc16.ibm_3740(body) != checksum:
        raise FrameError("checksum does not match")
    version, kind, sequence, board_time_us, count = _HEADER.unpack_from(body)
    if version != VERSION:
        raise FrameVersionError(
            f"the pad board sends frames of version {version}, this program reads version "
            f"{VERSION}: flash the sketch in hardware/firmware/pad_board"
        )
    if len(body) != _HEADER.size + 2 * count:
        raise FrameError(f"{len(body)} bytes do not hold {count} readings")
    readings = struct.unpack_from(f"<{count}H", body, _HEADER.size)
    return Frame(sequence, board_time_us, readings, kind)


class FrameReader:
    """Finds frames in a stream of bytes, however it is cut into pieces.

    Attributes:
        bad: Damaged frames so far.
        bytes_seen: Bytes so far.
    """

    def __init__(self) -> None:
        self.bad = 0
        self.bytes_seen = 0
        self._rest = b""
        self._synchronised = False  # the first bytes may be the end of a frame begun before

    def feed(self, chunk: bytes) -> list[Frame]:
        """The frames that these bytes complete.

        Raises:
            FrameVersionError: The board speaks another version of the format.
        """
        self.bytes_seen += len(chunk)
        *packets, self._rest = (self._rest + chunk).split(b"\0")
        if packets and not self._synchronised:
            self._synchronised = True
            packets = packets[1:]
        if len(self._rest) > _LONGEST:  # noise without a zero: wait for the next one
            self.bad += self._synchronised
            self._rest, self._synchronised = b"", False
        frames = (self._decode(packet) for packet in packets if packet)
        return [frame for frame in frames if frame is not None]

    def _decode(self, packet: bytes) -> Frame | None:
        try:
            return decode(packet)
        except FrameVersionError:
            raise
        except FrameError:
            self.bad += 1
            return None
