# SPDX-License-Identifier: MIT
"""From a bag's bytes to stamped messages in order, with a sentence for what is left out."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Any, TypeVar

from ..exceptions import RecordingError
from .messages import stamp_ns
from .source import BagMessage

CALENDAR_NS = 10**18  # [ns], stamps from 2001 on count from 1970, and none of them can be 0

Entry = TypeVar("Entry", bound=tuple[Any, ...])


def decode(
    topic: str, bag: Sequence[BagMessage], expected: Collection[str], warnings: list[str]
) -> list[tuple[int, Any]]:
    """Stamps [ns] and messages of a topic; receive times where its headers have no stamps.

    Raises:
        RecordingError: A message has none of the expected types, or its bytes make no sense.
    """
    wrong = sorted({message.msgtype for message in bag} - set(expected))
    if wrong:
        raise RecordingError(
            f"topic {topic} has type {wrong[0]}, expected {' or '.join(sorted(expected))}"
        )
    try:
        received = [(message.receive_ns, message.decode(message.data)) for message in bag]
    except RecordingError:
        raise
    except (
        Exception
    ) as error:  # a definition that does not fit the bytes makes decoders raise anything
        raise RecordingError(f"topic {topic} cannot be decoded: {error}") from error
    if not all(hasattr(message, "header") for _, message in received):
        return received
    stamped = [(stamp_ns(message), message) for _, message in received]
    if len(stamped) > 1 and not any(stamp for stamp, _ in stamped):
        warnings.append(f"topic {topic} has no stamps in its headers; its receive times are used")
        return received
    kept = [entry for entry in stamped if entry[0] or stamped[-1][0] < CALENDAR_NS]
    note(warnings, topic, len(stamped) - len(kept), len(stamped), "have no stamp")
    return kept


def in_order(entries: Sequence[Entry], topic: str, warnings: list[str]) -> list[Entry]:
    """Entries sorted by their first item, the stamp; of several with one stamp the last received."""
    last = {entry[0]: entry for entry in entries}
    note(warnings, topic, len(entries) - len(last), len(entries), "have another one's stamp")
    return [last[stamp] for stamp in sorted(last)]


def note(warnings: list[str], topic: str, left_out: int, count: int, why: str) -> None:
    """Say how many of a topic's messages are left out, if any, and why."""
    if left_out:
        warnings.append(f"topic {topic}: {left_out} of {count} messages are left out, they {why}")
