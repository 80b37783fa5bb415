# SPDX-License-Identifier: MIT
"""Read an MCAP file from front to back, whether it is whole or cut off by a crash.

The mcap library's readers want a file's end first and, on a broken one, raise anything from
``struct.error`` to ``MemoryError``. Here each record is taken only if it lies in the file in full;
the library then parses its bytes, and a record that it cannot parse is counted as lost.
"""

from __future__ import annotations

import dataclasses
import io
import os
import struct
import zlib
from collections.abc import Callable, Container, Iterator
from pathlib import Path
from typing import BinaryIO

from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode
from mcap.records import (
    Attachment,
    Channel,
    Chunk,
    DataEnd,
    Footer,
    McapRecord,
    Message,
    Metadata,
    Schema,
    Statistics,
)
from mcap.stream_reader import breakup_chunk

from .. import limits
from ..exceptions import RecordingError
from .mcap_decode import Decoder
from .mcap_salvage import whole_records
from .source import BagMessage
from .unpack import count_records, unpack

MAGIC = b"\x89MCAP0\r\n"
_RECORD_HEADER = struct.Struct("<BQ")  # opcode, length of what follows
NEVER_NS = 2**63  # [ns], the year 2262: no message is received then


class McapFile:
    """One MCAP file.

    Attributes:
        path, topics, metadata, attachments: As ``Source`` has them.
        warnings: At most one sentence, which says what of the file could not be read.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.topics: dict[str, str] = {}
        self.metadata: dict[str, dict[str, str]] = {}
        self.attachments: dict[str, bytes] = {}
        self.warnings: list[str] = []

    def messages(self, topics: Container[str] | None = None) -> Iterator[BagMessage]:
        """Messages in the file's order, those of ``topics`` or all.

        Raises:
            RecordingError: The file is no MCAP file, or compressed in an unknown way.
        """
        reader = _RecordReader(self.path)
        schemas: dict[int, Schema] = {}
        channels: dict[int, Channel] = {}
        decoders: dict[int, Decoder] = {}
        last_ns: int | None = None
        for record in reader.records():
            if isinstance(record, Schema):
                schemas[record.id] = record
            elif isinstance(record, Channel):
                channels[record.id] = record
                decoders[record.id] = Decoder(record, schemas.get(record.schema_id))
                self.topics[record.topic] = decoders[record.id].msgtype
            elif isinstance(record, Metadata):
                self.metadata[record.name] = record.metadata
            elif isinstance(record, Attachment):
                self.attachments[record.name] = record.data
            elif isinstance(record, Message) and record.channel_id not in channels:
                reader.orphans += 1
            elif isinstance(record, Message) and record.log_time >= NEVER_NS:
                reader.broken += len(record.data)
            elif isinstance(record, Message):
                last_ns = max(record.log_time, last_ns or 0)
                topic, decode = channels[record.channel_id].topic, decoders[record.channel_id]
                if topics is None or topic in topics:
                    yield BagMessage(topic, decode.msgtype, record.log_time, record.data, decode)
        loss = reader.loss(last_ns)
        self.warnings = [loss] if loss else []

    def span(self) -> tuple[int, int] | None:
        """When the first and the last message were received [ns], from the index where there is one."""
        from mcap.reader import SeekingReader

        try:
            with self.path.open("rb") as file:
                summary = SeekingReader(file).get_summary()
            found = summary and summary.statistics
            if found and found.message_count:
                for record in _RecordReader(self.path).records():  # it is written first
                    if not isinstance(record, Metadata):
                        break
                    self.metadata[record.name] = record.metadata
                return found.message_start_time, found.message_end_time
        except Exception:  # no index, or a damaged one: the library raises anything
            pass
        received = [message.receive_ns for message in self.messages()]
        return (min(received), max(received)) if received else None


def read_records(path: Path) -> Iterator[McapRecord]:
    """All records of a file that can be read, in its order, messages as they are stored.

    Raises:
        RecordingError: The file is no MCAP file, or compressed in an unknown way.
    """
    return _RecordReader(path).records()


class _RecordReader:
    """Records of a file that may end anywhere."""

    def __init__(self, path: Path) -> None:
        self.path = path
        self.size = path.stat().st_size
        self.read_to = 0  # [bytes], end of the last whole record
        self.ended = False  # whether the data section's end was seen
        self.has_index = False  # whether the index after it is there in full
        self.broken = 0  # [bytes] of records that are there but damaged
        self.unpacked = 0  # [bytes] of chunks so far
        self.packed_records = 0  # in them
        self.orphans = 0  # messages whose channel was in a damaged record
        self.messages = 0  # that could be read
        self.counted: int | None = None  # messages, as the file's own statistics say
        self.changed = False  # whether the checksum of all data is another
        self._checksum = 0  # of what was read
        self._channels: set[int] = set()  # seen so far
        self._repeated = False  # whether the summary was asked for them
        self._cut_chunk = b""  # what is left of a chunk that the file ends in

    def records(self) -> Iterator[McapRecord]:
        with self.path.open("rb") as file:
            if file.read(len(MAGIC)) != MAGIC:
                what = "is empty" if self.size == 0 else "is not an MCAP file"
                raise RecordingError(
                    f"{self.path} {what}; expected an .mcap file, a rosbag2 folder or a ROS 1 .bag"
                )
            self.read_to = len(MAGIC)
            self._checksum = zlib.crc32(MAGIC)
            while (found := self._next(file)) is not None:
                opcode, content = found
                if opcode == Opcode.DATA_END:
                    self._end_data(content)
                elif opcode == Opcode.STATISTICS:
                    self._compare(content)
                elif not self.ended or opcode in _DATA:  # the summary repeats the rest
                    yield from self._counted(self._parse(opcode, content))
            yield from self._counted(whole_records(self._cut_chunk))
            self.has_index = self.ended and _ends_with_magic(file)

    def _next(self, file: BinaryIO) -> tuple[int, bytes] | None:
        """The next whole record, or None where there is none."""
        start = file.read(_RECORD_HEADER.size)
        if len(start) < _RECORD_HEADER.size or (self.ended and start.startswith(MAGIC)):
            return None
        opcode, length = _RECORD_HEADER.unpack(start)
        end = self.read_to + _RECORD_HEADER.size + length
        if opcode == 0 or end > self.size:  # 0: zeros that a crashed file system left
            self._cut_chunk = file.read() if opcode == Opcode.CHUNK else b""
            return None
        self.read_to = end
        limit = limits.ATTACHED_BYTES if opcode == Opcode.ATTACHMENT else limits.CHUNK_BYTES
        limits.check(length, limit, f"bytes in one record of {self.path}", RecordingError)
        content = file.read(length)
        if opcode != Opcode.DATA_END and not self.ended:
            self._checksum = zlib.crc32(content, zlib.crc32(start, self._checksum))
        return opcode, content

    def _end_data(self, content: bytes) -> None:
        """Take the data section's end; a record of another size was something else before a bit changed."""
        if len(content) != _DATA_END_BYTES:
            self.broken += len(content)
            return
        checksum = DataEnd.read(_stream(content)).data_section_crc
        self.ended, self.changed = True, checksum not in (0, self._checksum)

    def _compare(self, content: bytes) -> None:
        try:
            self.counted = Statistics.read(_stream(content)).message_count
        except Exception:  # damaged bytes make the parsers raise anything
            self.broken += len(content)

    def _counted(self, records: list[McapRecord]) -> Iterator[McapRecord]:
        for record in records:
            if isinstance(record, Channel):
                self._channels.add(record.id)
            elif isinstance(record, Message):
                self.messages += 1
                if record.channel_id not in self._channels and not self._repeated:
                    self._repeated = True  # its channel was in a damaged record
                    yield from self._repeats()
            yield record

    def _repeats(self) -> list[McapRecord]:
        """Schemas and channels as the summary at the file's end repeats them."""
        try:
            with self.path.open("rb") as file:
                file.seek(-len(MAGIC) - _FOOTER_BYTES, os.SEEK_END)
                footer = Footer.read(_stream(file.read(_FOOTER_BYTES)))
                file.seek(footer.summary_start)
                stream = ReadDataStream(file)
                found: list[McapRecord] = []
                while stream.read1() in (Opcode.SCHEMA, Opcode.CHANNEL):
                    file.seek(-1, os.SEEK_CUR)
                    opcode, length = _RECORD_HEADER.unpack(file.read(_RECORD_HEADER.size))
                    found.append(_READERS[opcode](_stream(file.read(length))))
        except Exception:  # no summary, or a damaged one
            return []
        return found

    def _parse(self, opcode: int, content: bytes) -> list[McapRecord]:
        try:
            if opcode == Opcode.CHUNK:
                return self._unpacked(Chunk.read(_stream(content)))
            if opcode == Opcode.MESSAGE:
                return [Message.read(_stream(content), len(content))]
            if opcode == Opcode.ATTACHMENT:
                return [_attachment(content)]
            if opcode in _READERS:
                return [_READERS[opcode](_stream(content))]
        except RecordingError as error:  # nothing that damage explains
            raise RecordingError(f"{self.path}: {error}") from None
        except Exception:  # damaged bytes make the parsers raise anything
            self.broken += len(content)
        return []

    def _unpacked(self, chunk: Chunk) -> list[McapRecord]:
        """A chunk's records, if the file does not hold far more than its size explains."""
        data = unpack(chunk)
        self.unpacked += len(data)
        bytes_limit = limits.UNPACKED_BYTES + limits.UNPACKED_RATIO * self.size
        limits.check(self.unpacked, bytes_limit, "bytes, unpacked,", RecordingError)
        records_limit = limits.MESSAGES + int(limits.MESSAGES_PER_BYTE * self.size)
        self.packed_records += count_records(data, records_limit * limits.factor())
        limits.check(self.packed_records, records_limit, "messages", RecordingError)
        return breakup_chunk(dataclasses.replace(chunk, compression="", data=data))

    def loss(self, last_ns: int | None) -> str | None:
        """What could not be read, in one sentence, or None."""
        missing = max((self.counted or 0) - self.messages, 0)
        if self.ended and not self.broken and not self.orphans and not missing:
            if self.changed:
                return (
                    "the file is damaged: its checksum is another, so that a byte of its metadata or of an "
                    "index has changed; copy it again, or do not trust what it says of hand and object"
                )
            return None if self.has_index else "the file's index is cut off, but no message is lost"
        if self.ended:
            count = f", {missing} of its {self.counted} messages among them" if missing else ""
            return (
                f"the file is damaged: {self.broken} of its {self.size} bytes cannot be "
                f"read, and the messages in them are lost{count}"
                if self.broken or self.orphans
                else f"the file is damaged: {missing} of its {self.counted} messages cannot be found"
            )
        tail = self.size - self.read_to + self.broken
        cut = (
            f"the file is cut off: its last {tail} of {self.size} bytes cannot be read in full, and"
            if tail
            else f"the file is cut off, or still being written: it ends after {self.size} bytes, and"
        )
        if last_ns is None:
            return f"{cut} no message is left; record it again, or copy it again if a copy was cut"
        return f"{cut} what was recorded after {last_ns / 1e9:.2f} s is lost; the rest is used"


_DATA = frozenset({Opcode.CHUNK, Opcode.MESSAGE})
_DATA_END_BYTES = 4
_FOOTER_BYTES = 20
_READERS: dict[int, Callable[[ReadDataStream], McapRecord]] = {
    Opcode.SCHEMA: Schema.read,
    Opcode.CHANNEL: Channel.read,
    Opcode.METADATA: Metadata.read,
}


def _ends_with_magic(file: BinaryIO) -> bool:
    file.seek(-len(MAGIC), os.SEEK_END)
    return file.read() == MAGIC


def _stream(content: bytes) -> ReadDataStream:
    return ReadDataStream(io.BytesIO(content))


def _attachment(content: bytes) -> Attachment:
    attachment: Attachment = Attachment.read(_stream(content))
    (crc,) = struct.unpack("<I", content[-4:])
    if crc and crc != zlib.crc32(content[:-4]):  # which the library does not check
        raise ValueError("damaged attachment")
    return attachment
