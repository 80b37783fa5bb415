# SPDX-License-Identifier: MIT
"""What is in a recording: its streams with their rates and gaps, and what is wrong with it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..input.plain import plain
from . import names
from .bags import open_source
from .decode import CALENDAR_NS
from .messages import is_known, stamp_ns
from .source import BagMessage
from .usable import try_to_use

if TYPE_CHECKING:
    from ..hands.pads import PadSet
    from ..objects import ObjectModel
    from .topics import TopicMap

GAP_PERIODS = 5  # a pause of so many usual periods is a gap
ON_CHANGE = (names.HAND_POSE, names.CAMERA_POSE, names.CAMERA_INFO)  # pauses are no gaps there
LONGEST_LINE = 2000  # [characters]
_NAME = re.compile(r"[\w/~.-]{1,100}")
_OURS = ("note", "warning", "problem", "attached")
LEAST_DELAY = 1e-3  # [s], from stamp to receipt, that is shown
LARGEST_DECODED = (
    1 << 16
)  # [bytes], of larger messages of types that nobody needs only the receipt is shown
LONGEST_VALUE = 70  # [characters] of a metadata value that are shown


@dataclass(frozen=True)
class StreamSummary:
    """One topic of a recording.

    Attributes:
        topic: Its name.
        msgtype: Its type.
        count: Number of messages.
        start: First stamp [s].
        end: Last stamp [s].
        period: Median time between two messages [s], NaN for fewer than two.
        longest_gap: Longest time between two messages [s], NaN for fewer than two.
        out_of_order: Number of messages stamped before the one in front of them.
        bytes: Size of all messages.
        delay: Median time from stamp to receipt [s].
        undecoded: Number of messages whose stamps cannot be read; their receipt counts in this place.
    """

    topic: str
    msgtype: str
    count: int
    start: float
    end: float
    period: float
    longest_gap: float
    out_of_order: int
    bytes: int
    delay: float = 0.0
    undecoded: int = 0

    @property
    def rate(self) -> float:
        """Usual number of messages a second [Hz], NaN for fewer than two."""
        return 1.0 / self.period if self.period > 0 else float("nan")


@dataclass(frozen=True)
class Inspection:
    """What ``inspect_recording`` found.

    Attributes:
        path: The recording.
        info: Its metadata.
        attachments: Size of each attached file [bytes].
        streams: Its topics, by name.
        object: The object's name and size, None where it cannot be had.
        frames: Number of frames the estimator would get at rate "vision"; None where it cannot.
        problems: What is wrong, a sentence each; empty for a sound recording.
        warnings: What may be right but seldom is.
        notes: What is not wrong but worth knowing.
    """

    path: Path
    info: dict[str, str]
    attachments: dict[str, int]
    streams: list[StreamSummary]
    object: str | None
    frames: int | None
    problems: list[str]
    warnings: list[str]
    notes: list[str]

    def lines(self) -> Iterator[str]:
        """The findings as text."""
        yield from (plain(line, LONGEST_LINE) for line in self._lines())

    def _lines(self) -> Iterator[str]:
        yield str(self.path)
        for key, value in self.info.items():
            yield f"  {_told(key)}: {plain(value, LONGEST_VALUE)}"
        for name, size in self.attachments.items():
            yield f"  attached: {plain(name, LONGEST_VALUE)}, {size / 1024:.0f} KiB"
        width = max((len(_told(stream.topic)) for stream in self.streams), default=0)
        for stream in self.streams:
            yield "  " + _stream_line(stream, width)
        if self.object is not None:
            yield f"  {self.object}"
        if self.frames is not None:
            yield f"  frames for the estimator: {self.frames}"
        yield from (f"  note: {note}" for note in self.notes)
        yield from (f"  warning: {warning}" for warning in self.warnings)
        yield from (f"  problem: {problem}" for problem in self.problems)
        if not self.problems and not self.warnings:
            yield "  no problems found"


def _told(name: str) -> str:
    """A name from the recording, in quotes where it could pass for a word of ours."""
    return name if _NAME.fullmatch(name) and name not in _OURS else repr(plain(name, LONGEST_VALUE))


def _stream_line(stream: StreamSummary, width: int) -> str:
    kind = plain(stream.msgtype.split("/")[-1], 26) or "no type"
    line = f"{_told(stream.topic):<{width}}  {stream.count:6d} {kind:<26} {stream.start:9.2f} s"
    if stream.count > 1:
        line += f" to {stream.end:.2f} s, {stream.rate:.1f} Hz"
        line += f", longest gap {stream.longest_gap * 1e3:.0f} ms"
    if abs(stream.delay) >= LEAST_DELAY:
        line += f", received {_delay(stream.delay)} its stamp"
    return line


def _delay(seconds: float) -> str:
    size = f"{abs(seconds):.1f} s" if abs(seconds) >= 1 else f"{abs(seconds) * 1e3:.0f} ms"
    return f"{size} {'after' if seconds > 0 else 'before'}"


def inspect_recording(
    path: str | Path,
    hand: PadSet | str | Path | None = None,
    topics: TopicMap | str | Path | None = None,
    object: ObjectModel | str | Path | None = None,
) -> Inspection:
    """Look into a recording.

    Args:
        path: The recording.
        hand: The hand, as ``read_recording`` takes it.
        topics: The topic map, as ``read_recording`` takes it.
        object: The object, as ``read_recording`` takes it.

    Raises:
        RecordingError: The path holds no recording at all.
    """
    source = open_source(path)
    tallies: dict[str, _Tally] = {}
    for message in source.messages():
        tallies.setdefault(message.topic, _Tally()).add(message)
    streams = [
        tally.summary(topic, source.topics[topic]) for topic, tally in sorted(tallies.items())
    ]
    use = try_to_use(path, hand, object, topics)
    return Inspection(
        path=Path(path),
        info=source.metadata.get(names.METADATA, {}),
        attachments={name: len(data) for name, data in source.attachments.items()},
        streams=streams,
        object=use.object,
        frames=use.frames,
        problems=use.problems
        + [
            problem
            for stream in streams
            if stream.topic in use.topics
            for problem in _stream_problems(stream, use.vision_topic)
        ],
        warnings=use.warnings,
        notes=use.notes,
    )


class _Tally:
    """What is counted of one topic."""

    def __init__(self) -> None:
        self.stamps: list[int | None] = []
        self.received: list[int] = []
        self.bytes = 0
        self.undecoded = 0

    def add(self, message: BagMessage) -> None:
        self.received.append(message.receive_ns)
        self.bytes += len(message.data)
        self.stamps.append(self._stamp(message))

    def _stamp(self, message: BagMessage) -> int | None:
        """The header's stamp [ns]; None where there is none, or the message is none of ours and large."""
        if not is_known(message.msgtype) and len(message.data) > LARGEST_DECODED:
            return None
        try:
            decoded = message.decode(message.data)
            return stamp_ns(decoded) if hasattr(decoded, "header") else None
        except (
            Exception
        ):  # a topic that nobody needs may hold anything; what is needed is read elsewhere
            self.undecoded += 1
            return None

    def summary(self, topic: str, msgtype: str) -> StreamSummary:
        times = self._times()
        seconds = times / 1e9
        ordered = np.sort(seconds)
        steps = np.diff(ordered)
        return StreamSummary(
            topic=topic,
            msgtype=msgtype,
            count=len(times),
            start=float(ordered[0]),
            end=float(ordered[-1]),
            period=_period(steps),
            longest_gap=float(steps.max()) if len(steps) else float("nan"),
            out_of_order=int(np.count_nonzero(np.diff(seconds) < 0)),
            bytes=self.bytes,
            delay=float(np.median(np.array(self.received) - times)) / 1e9,
            undecoded=self.undecoded,
        )

    def _times(self) -> np.ndarray:
        """The stamps [ns], and the receipt where there is none: 0 is one in simulation time only."""
        none = (None, 0) if max(s or 0 for s in self.stamps) >= CALENDAR_NS else (None,)
        if not any(self.stamps):
            none = (None, 0)
        pairs = zip(self.stamps, self.received, strict=True)
        return np.array([r if s in none else s for s, r in pairs], dtype=np.int64)


def _period(steps: np.ndarray) -> float:
    """The usual time between messages [s]; the mean where most of them share their stamps."""
    if len(steps) == 0:
        return float("nan")
    median = float(np.median(steps))
    return median if median > 0 else float(np.mean(steps))


def _stream_problems(stream: StreamSummary, vision_topic: str | None) -> Iterator[str]:
    # A visual tracker that has lost the object is silent, and a note says what comes of it.
    may_pause = stream.topic in (*ON_CHANGE, vision_topic)
    if not may_pause and stream.longest_gap > GAP_PERIODS * stream.period:
        yield (
            f"{stream.topic} pauses for {stream.longest_gap:.2f} s, "
            f"usually it comes every {stream.period * 1e3:.0f} ms"
        )
    if stream.out_of_order:
        yield f"{stream.topic} has {stream.out_of_order} messages out of order; they get sorted"
