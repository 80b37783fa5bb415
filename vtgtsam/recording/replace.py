# SPDX-License-Identifier: MIT
"""A copy of an MCAP file in which one topic has other messages; all else is the same, byte for byte."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from mcap.records import Attachment, Channel, McapRecord, Message, Metadata, Schema
from mcap.writer import Writer

from .. import __version__
from . import messages, names
from .mcap_file import read_records
from .writer import MAX_CHUNK_BYTES

StampedBytes = tuple[int, bytes]  # stamp [ns], encoded message


def replace_topic(
    source: Path,
    out: Path,
    topic: str,
    msgtype: str,
    stamped: Iterable[StampedBytes],
    metadata: Mapping[str, str],
) -> None:
    """Copy a recording with other messages on one topic.

    Args:
        source: The MCAP file to copy; what a crash cut off of it is left out.
        out: The file to write, another one.
        topic: The topic whose messages are replaced, or which is added. What was said of the visual poses' errors goes
            with them.
        msgtype: Type of the new messages.
        stamped: The new messages, by increasing stamps.
        metadata: Entries of the metadata record ``vtgtsam`` to set.
    """
    with out.open("wb") as file:
        copy = _Copy(
            Writer(file, chunk_size=MAX_CHUNK_BYTES, enable_data_crcs=True), topic, metadata
        )
        pending = list(stamped)[::-1]
        for record in read_records(source):
            if isinstance(record, Message):
                while pending and pending[-1][0] <= record.log_time:
                    copy.add(msgtype, *pending.pop())
            copy.take(record)
        while pending:
            copy.add(msgtype, *pending.pop())
        copy.finish()


class _Copy:
    """Writes records under new numbers."""

    def __init__(self, writer: Writer, topic: str, metadata: Mapping[str, str]) -> None:
        self._writer, self._topic, self._metadata = writer, topic, metadata
        self._left_out = (topic, *([names.VISION_CORRELATION] if topic == names.VISION else []))
        self._schemas = {0: 0}  # by the source's number; 0 is none
        self._channels: dict[int, int] = {}
        self._added: int | None = None  # the topic's channel
        self._count = 0
        writer.start(profile="ros2", library=f"vtgtsam {__version__}")

    def take(self, record: McapRecord) -> None:
        """Copy a record, unless it belongs to the topic that is replaced."""
        writer = self._writer
        if isinstance(record, Schema):
            if record.id not in self._schemas:
                number = writer.register_schema(record.name, record.encoding, record.data)
                self._schemas[record.id] = number
        elif isinstance(record, Channel):
            if record.id not in self._channels and record.topic not in self._left_out:
                self._channels[record.id] = writer.register_channel(
                    record.topic,
                    record.message_encoding,
                    self._schemas.get(record.schema_id, 0),
                    record.metadata,
                )
        elif isinstance(record, Message):
            if record.channel_id in self._channels:
                writer.add_message(
                    self._channels[record.channel_id],
                    record.log_time,
                    record.data,
                    record.publish_time,
                    record.sequence,
                )
        elif isinstance(record, Metadata):
            ours = self._metadata if record.name == names.METADATA else {}
            writer.add_metadata(record.name, {**record.metadata, **ours})
        elif isinstance(record, Attachment):
            writer.add_attachment(
                record.create_time, record.log_time, record.name, record.media_type, record.data
            )

    def add(self, msgtype: str, stamp: int, data: bytes) -> None:
        """Write a message on the topic."""
        if self._added is None:
            text = messages.definition(msgtype).encode()
            schema = self._writer.register_schema(msgtype, "ros2msg", text)
            self._added = self._writer.register_channel(self._topic, "cdr", schema)
        self._count += 1
        self._writer.add_message(self._added, stamp, data, stamp, self._count)

    def finish(self) -> None:
        """Write the index."""
        self._writer.finish()  # type: ignore[no-untyped-call]
