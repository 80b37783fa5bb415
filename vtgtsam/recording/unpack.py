# SPDX-License-Identifier: MIT
"""A chunk of an MCAP file, unpacked no further than the limits: what it says of its own size proves nothing."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable

import lz4.frame
import zstandard
from mcap.records import Chunk

from .. import limits
from ..exceptions import RecordingError

_RECORD_HEADER = struct.Struct("<BQ")  # opcode, length of what follows


def unpack(chunk: Chunk) -> bytes:
    """The records of a chunk.

    Raises:
        RecordingError: It is compressed in an unknown way, or larger than the limit.
        ValueError: It is damaged.
    """
    if chunk.compression not in _UNPACK:
        raise RecordingError(
            f"unsupported compression type {chunk.compression!r}; expected zstd, lz4 or none"
        )
    limits.check(
        chunk.uncompressed_size, limits.CHUNK_BYTES, "bytes in a chunk, unpacked,", RecordingError
    )
    data = _UNPACK[chunk.compression](chunk.data, chunk.uncompressed_size + 1)
    if len(data) != chunk.uncompressed_size:
        raise ValueError(f"{len(data)} bytes in the place of {chunk.uncompressed_size}")
    if chunk.uncompressed_crc and zlib.crc32(data) != chunk.uncompressed_crc:
        raise ValueError("the checksum is another")
    return data


def count_records(data: bytes, most: float) -> int:
    """Number of records in an unpacked chunk, counted before any of them is taken, to just beyond ``most``."""
    count = place = 0
    while place + _RECORD_HEADER.size <= len(data) and count <= most:
        _, length = _RECORD_HEADER.unpack_from(data, place)
        place += _RECORD_HEADER.size + length
        count += 1
    return count


def _zstd(data: bytes, most: int) -> bytes:
    with zstandard.ZstdDecompressor().stream_reader(data) as stream:
        return stream.read(most)


def _lz4(data: bytes, most: int) -> bytes:
    unpacker = lz4.frame.LZ4FrameDecompressor()
    return bytes(unpacker.decompress(data, max_length=most))


_UNPACK: dict[str, Callable[[bytes, int], bytes]] = {
    "": lambda data, most: data,
    "zstd": _zstd,
    "lz4": _lz4,
}
