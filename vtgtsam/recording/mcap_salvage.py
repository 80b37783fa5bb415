# SPDX-License-Identifier: MIT
"""What can still be read of a chunk that the file ends in."""

from __future__ import annotations

import io
import struct
import zlib
from collections.abc import Callable

import lz4.frame
import zstandard
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import Channel, McapRecord, Message, Schema

from .. import limits

_TIMES = struct.Struct(
    "<QQQII"
)  # first and last instant, size and checksum unpacked, length of a name
_LENGTH = struct.Struct("<Q")
_RECORD = struct.Struct("<BQ")  # opcode, length of what follows


def whole_records(content: bytes) -> list[McapRecord]:
    """The records that lie in full in the first bytes of a chunk's content.

    Where the chunk is there in full, the record around it being damaged, its checksum must be right.
    """
    try:
        _, _, size, checksum, name_length = _TIMES.unpack_from(content)
        place = _TIMES.size + name_length
        compression = content[_TIMES.size : place].decode()
        (length,) = _LENGTH.unpack_from(content, place)
        packed = content[place + _LENGTH.size :][:length]
        data = _UNPACK[compression](packed, min(size, int(limits.CHUNK_BYTES * limits.factor())))
    except Exception:  # damaged bytes make the libraries raise anything
        return []
    if len(packed) == length and zlib.crc32(data) != checksum:
        return []
    return _records(data)


def _records(data: bytes) -> list[McapRecord]:
    records: list[McapRecord] = []
    place = 0
    while place + _RECORD.size <= len(data):
        opcode, length = _RECORD.unpack_from(data, place)
        place += _RECORD.size
        if place + length > len(data):
            break
        stream = ReadDataStream(io.BytesIO(data[place : place + length]))
        try:
            if opcode == Opcode.MESSAGE:
                records.append(Message.read(stream, length))
            elif opcode in _READERS:
                records.append(_READERS[opcode](stream))
        except Exception:  # damaged bytes, as above: what comes after them cannot be trusted
            break
        place += length
    return records


def _zstd(data: bytes, most: int) -> bytes:
    with zstandard.ZstdDecompressor().stream_reader(data) as stream:
        return stream.read(most)


def _lz4(data: bytes, most: int) -> bytes:
    return bytes(lz4.frame.LZ4FrameDecompressor().decompress(data, max_length=most))


_UNPACK: dict[str, Callable[[bytes, int], bytes]] = {
    "": lambda data, most: data[:most],
    "zstd": _zstd,
    "lz4": _lz4,
}
_READERS: dict[int, Callable[[ReadDataStream], McapRecord]] = {
    Opcode.SCHEMA: Schema.read,
    Opcode.CHANNEL: Channel.read,
}
