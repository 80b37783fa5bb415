# SPDX-License-Identifier: MIT
"""What a recording is read from: a bag of messages, whatever file holds it."""

from __future__ import annotations

from collections.abc import Callable, Container, Iterator
from pathlib import Path
from typing import Any, NamedTuple, Protocol


class BagMessage(NamedTuple):
    """One message of a bag.

    Attributes:
        topic: Its topic.
        msgtype: Its type, such as sensor_msgs/msg/JointState.
        receive_ns: When it was received [ns].
        data: Its bytes as they are stored.
        decode: Function from such bytes to the message with its fields, one for the whole topic. It
            raises RecordingError where the bag does not say how to read this type.
    """

    topic: str
    msgtype: str
    receive_ns: int
    data: bytes
    decode: Callable[[bytes], Any]


class Source(Protocol):
    """A bag that can be read from front to back, several times.

    All attributes but ``path`` are complete after ``messages`` has run.

    Attributes:
        path: Where it lies.
        topics: Type of each topic.
        metadata: Metadata records by name.
        attachments: Attached files by name.
        warnings: Sentences on what could not be read.
    """

    path: Path
    topics: dict[str, str]
    metadata: dict[str, dict[str, str]]
    attachments: dict[str, bytes]
    warnings: list[str]

    def messages(self, topics: Container[str] | None = None) -> Iterator[BagMessage]:
        """Messages in the bag's order, those of ``topics`` or all.

        Raises:
            RecordingError: The bag cannot be read.
        """
        ...
