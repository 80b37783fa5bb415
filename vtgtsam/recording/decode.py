# SPDX-License-Identifier: MIT
"""From a bag's bytes to stamped messages in order, with a sentence for what is left out."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np

from ..exceptions import RecordingError
from .messages import stamp_ns
from .source import BagMessage

CALENDAR_NS = 10**18  # [ns], stamps from 2001 on count from 1970, and none of them can be 0

Entry = TypeVar("Entry", bound=tuple[Any, ...])


@dataclass(frozen=True, eq=False)
class Arrivals:
    """When a topic's messages were stamped and when they were received, in the bag's order.

    Attributes:
        stamps_ns: Instants in the headers [ns], int64, shape (N,); of receipt where there are none.
        received_ns: Instants of receipt [ns], int64, shape (N,).
    """

    stamps_ns: np.ndarray
    received_ns: np.ndarray

    @property
    def delay(self) -> float:
        """Median time from stamp to receipt [s]."""
        return float(np.median(self.received_ns - self.stamps_ns)) / 1e9

    @property
    def delay_change(self) -> float:
        """By how much that time is longer in the last fifth of the messages than in the first [s]."""
        delays = self.received_ns - self.stamps_ns
        fifth = max(len(delays) // 5, 1)
        return float(np.median(delays[-fifth:]) - np.median(delays[:fifth])) / 1e9


@dataclass(frozen=True, eq=False)
class Decoded:
    """A topic's messages.

    Attributes:
        entries: Stamp [ns] and message, in the bag's order.
        arrivals: Their stamps and receipts; None where there are none.
    """

    entries: list[tuple[int, Any]]
    arrivals: Arrivals | None

    @property
    def received(self) -> list[tuple[int, Any, int]]:
        """Stamp [ns], message and instant of receipt [ns] of each."""
        known = [] if self.arrivals is None else self.arrivals.received_ns.tolist()
        entries = zip(self.entries, known, strict=True)
        return [(stamp, message, received) for (stamp, message), received in entries]


def decode(
    topic: str, bag: Sequence[BagMessage], expected: Collection[str], warnings: list[str]
) -> Decoded:
    """Messages of a topic by their stamps; by receive times where its headers have none.

    A message that cannot be used costs itself, and how many there are is told.

    Raises:
        RecordingError: No message has one of the expected types, or none can be decoded.
    """
    right = [message for message in bag if message.msgtype in expected]
    if bag and not right:
        has = bag[0].msgtype or "no type in the file"
        raise RecordingError(
            f"topic {topic} has {'type ' if bag[0].msgtype else ''}{has}, expected "
            f"{' or '.join(sorted(expected))}{_advice(bag[0].msgtype)}"
        )
    wrong = len(bag) - len(right)
    note(warnings, topic, wrong, len(bag), f"are no {' or '.join(sorted(expected))}")
    received = _decoded(topic, right, warnings)
    if not received:
        return Decoded([], None)
    if not all(hasattr(message, "header") for _, message in received):
        return _decoded_by(received, received)
    stamped = [(stamp_ns(message), message) for _, message in received]
    if len(stamped) > 1 and not any(stamp for stamp, _ in stamped):
        warnings.append(f"topic {topic} has no stamps in its headers; its receive times are used")
        return _decoded_by(received, received)
    calendar = stamped[-1][0] >= CALENDAR_NS
    kept = [k for k, (stamp, _) in enumerate(stamped) if stamp or not calendar]
    note(warnings, topic, len(stamped) - len(kept), len(stamped), "have no stamp")
    return _decoded_by([stamped[k] for k in kept], [received[k] for k in kept])


def _decoded_by(stamped: list[tuple[int, Any]], received: list[tuple[int, Any]]) -> Decoded:
    times = (np.array([time for time, _ in entries]) for entries in (stamped, received))
    return Decoded(stamped, Arrivals(*times))


def _decoded(topic: str, bag: Sequence[BagMessage], warnings: list[str]) -> list[tuple[int, Any]]:
    """Receive times [ns] and messages of those whose bytes make sense."""
    received: list[tuple[int, Any]] = []
    first: Exception | None = None
    for message in bag:
        try:
            received.append((message.receive_ns, message.decode(message.data)))
        except RecordingError:
            raise
        except Exception as error:  # bytes that do not fit the definition raise anything
            first = first or error
    if first is not None and not received:
        raise RecordingError(f"topic {topic} cannot be decoded: {first}") from first
    note(warnings, topic, len(bag) - len(received), len(bag), f"cannot be decoded ({first})")
    return received


def _advice(msgtype: str) -> str:
    """What to do with a type that people try."""
    if msgtype.endswith("TFMessage"):
        return "; /tf is not read: publish that transform as a PoseStamped or TransformStamped of its own"
    return ""


def in_order(entries: Sequence[Entry], topic: str, warnings: list[str]) -> list[Entry]:
    """Entries sorted by their first item, the stamp; of several with one stamp the last received."""
    last = {entry[0]: entry for entry in entries}
    note(warnings, topic, len(entries) - len(last), len(entries), "have another one's stamp")
    return [last[stamp] for stamp in sorted(last)]


def note(warnings: list[str], topic: str, left_out: int, count: int, why: str) -> None:
    """Say how many of a topic's messages are left out, if any, and why."""
    if left_out:
        warnings.append(f"topic {topic}: {left_out} of {count} messages are left out, they {why}")
