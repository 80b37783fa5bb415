# SPDX-License-Identifier: MIT
"""The rosbags library unpacks whatever a bag's chunks, messages and files say; here it stops at the limits."""

from __future__ import annotations

import bz2
import io
from types import SimpleNamespace
from typing import IO, Any

import lz4.frame
import zstandard

from .. import limits
from ..exceptions import RecordingError

_BLOCK = 1 << 20


def keep_limits() -> None:
    """Put bounded functions in the place of the library's own."""
    from rosbags.rosbag1 import reader as ros1
    from rosbags.rosbag2 import reader as ros2

    ros1.decompressors["bz2"] = _bz2
    ros1.decompressors["lz4"] = _lz4
    ros2.zstd = SimpleNamespace(decompress=_zstd, open=_zstd_file)


def _most() -> int:
    return int(limits.CHUNK_BYTES * limits.factor())


def _checked(data: bytes) -> bytes:
    limits.check(len(data), limits.CHUNK_BYTES, "bytes in a chunk, unpacked,", RecordingError)
    return data


def _bz2(data: bytes) -> bytes:
    return _checked(bz2.BZ2Decompressor().decompress(data, _most() + 1))


def _lz4(data: bytes) -> bytes:
    """Piece by piece: asked for a length, the library sets that much aside at once."""
    unpacker, size = lz4.frame.LZ4FrameDecompressor(), 0
    pieces: list[bytes] = []
    while size <= _most() and not unpacker.eof:
        piece = unpacker.decompress(data if not pieces else b"", max_length=_BLOCK)
        if not piece and unpacker.needs_input:
            break
        pieces.append(piece)
        size += len(piece)
    return _checked(b"".join(pieces))


def _zstd(data: bytes) -> bytes:
    with zstandard.ZstdDecompressor().stream_reader(data) as stream:
        return _checked(stream.read(_most() + 1))


def _zstd_file(file: IO[bytes], mode: str) -> _Bounded:
    return _Bounded(zstandard.ZstdDecompressor().stream_reader(file, read_across_frames=True))


class _Bounded(io.RawIOBase):
    """A stream that ends in an error beyond the limit of a whole recording."""

    def __init__(self, stream: Any) -> None:
        self._stream, self._size = stream, 0

    def readable(self) -> bool:
        return True

    def readinto(self, buffer: Any) -> int:
        data = self._stream.read(len(buffer))
        self._size += len(data)
        limits.check(self._size, limits.UNPACKED_BYTES, "bytes of a bag, unpacked,", RecordingError)
        buffer[: len(data)] = data
        return len(data)
