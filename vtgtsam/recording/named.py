# SPDX-License-Identifier: MIT
"""A topic of numbers by name over time: joint angles by joint, contact bits by pad."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ..exceptions import RecordingError
from . import messages
from .decode import Arrivals, decode, in_order, note
from .pad_calibration import pressures
from .source import BagMessage
from .topics import ContactsTopic

_FLOAT_ARRAYS = ("std_msgs/msg/Float32MultiArray", "std_msgs/msg/Float64MultiArray")
_BYTE_ARRAY = "std_msgs/msg/UInt8MultiArray"
ARRAYS = (*_FLOAT_ARRAYS, _BYTE_ARRAY)  # name no pads
TYPES_OF_CONTACTS = (messages.TACTILE_PADS, messages.JOINT_STATE)  # name them

# Stamp [ns], names, values, when it was received [ns].
Sample = tuple[int, tuple[str, ...], np.ndarray, int]
Piece = tuple[np.ndarray, np.ndarray, np.ndarray]  # stamps, values, receipts


@dataclass(frozen=True)
class NamedStream:
    """Values by name, each name with its own instants, for several publishers may share a topic.

    Attributes:
        columns: For each name, stamps [ns], int64, shape (N,), increasing, and values, shape (N,).
        arrivals: When messages were stamped and received.
        received_ns: For each name, when each value was received [ns], int64, shape (N,); empty where that is not known.
    """

    columns: dict[str, tuple[np.ndarray, np.ndarray]]
    arrivals: Arrivals | None = None
    received_ns: dict[str, np.ndarray] = field(default_factory=dict)

    @cached_property
    def times_ns(self) -> np.ndarray:
        """All stamps [ns], increasing."""
        return np.unique(np.concatenate([times for times, _ in self.columns.values()]))

    def held(self, instants_ns: np.ndarray, names: Sequence[str]) -> tuple[np.ndarray, np.ndarray]:
        """Last values at or before each instant, and how old the oldest of them is.

        Returns:
            Values, shape (F, len(names)), NaN where there is none yet, and ages [ns], shape (F,).
        """
        values = np.full((len(instants_ns), len(names)), np.nan)
        ages = np.zeros(len(instants_ns), dtype=np.int64)
        for k, name in enumerate(names):
            times, column = self.columns[name]
            index = np.searchsorted(times, instants_ns, side="right") - 1
            known = index >= 0
            values[known, k] = column[index[known]]
            ages[known] = np.maximum(ages[known], (instants_ns - times[index])[known])
        return values, ages

    def held_knowing(
        self, instants_ns: np.ndarray, known_ns: np.ndarray, names: Sequence[str]
    ) -> np.ndarray:
        """Last values at or before each instant that had been received when the frame was made.

        Args:
            instants_ns: The frames' instants [ns], shape (F,).
            known_ns: When each was made [ns], by the clock of receipts, shape (F,).
            names: The names.

        Returns:
            Values, shape (F, len(names)), NaN where there is none.
        """
        values = np.full((len(instants_ns), len(names)), np.nan)
        for k, name in enumerate(names):
            times, column = self.columns[name]
            index = last_known(times, self.received_ns.get(name, times), instants_ns, known_ns)
            values[index >= 0, k] = column[index[index >= 0]]
        return values

    def start_ns(self, names: Sequence[str]) -> int:
        """The instant from which all the names are known [ns]."""
        return max(int(self.columns[name][0][0]) for name in names)


def last_known(
    times_ns: np.ndarray, received_ns: np.ndarray, instants_ns: np.ndarray, known_ns: np.ndarray
) -> np.ndarray:
    """Index of the last sample at or before each instant among those received by then, shape (F,); -1 where none was.

    Args:
        times_ns: Stamps of the samples [ns], increasing, shape (N,).
        received_ns: When each was received [ns], shape (N,).
        instants_ns: The instants [ns], shape (F,).
        known_ns: Up to which receipt samples count for each [ns], shape (F,).
    """
    index = np.searchsorted(times_ns, instants_ns, side="right") - 1
    while (unknown := (index >= 0) & (received_ns[index] > known_ns)).any():
        index[unknown] -= 1
    return index


def read_joints(topic: str, bag: Sequence[BagMessage], warnings: list[str]) -> NamedStream | None:
    """Joint angles [rad] by joint name, or None where there are none that can be used."""
    decoded = decode(topic, bag, (messages.JOINT_STATE,), warnings)
    samples = [
        (stamp, tuple(message.name), np.asarray(message.position, dtype=np.float64), received)
        for stamp, message, received in decoded.received
    ]
    return _stream(samples, topic, decoded.arrivals, warnings)


def read_contacts(
    entry: ContactsTopic, bag: Sequence[BagMessage], warnings: list[str]
) -> NamedStream | None:
    """Contact bits (0 or 1) by pad name, or None where there are none that can be used."""
    types = {message.msgtype for message in bag}
    if messages.JOINT_STATE in types:
        return _effort_stream(entry, bag, warnings)
    if bag and messages.TACTILE_PADS not in types:
        return _array_stream(entry, bag, warnings)
    decoded = decode(entry.topic, bag, (messages.TACTILE_PADS,), warnings)
    samples: list[Sample] = []
    for stamp, message, received in decoded.received:
        if entry.threshold is None:
            bits = np.asarray(message.contact, dtype=np.float64)
        else:
            bits = contact_bits(message.pressure, entry.threshold)
        samples.append((stamp, tuple(message.name), bits, received))
    return _stream(samples, entry.topic, decoded.arrivals, warnings)


def _effort_stream(
    entry: ContactsTopic, bag: Sequence[BagMessage], warnings: list[str]
) -> NamedStream | None:
    """Contact bits of JointState messages, whose names are pads and whose efforts what they feel."""
    decoded = decode(entry.topic, bag, (messages.JOINT_STATE,), warnings)
    if entry.threshold is None:
        raise RecordingError(
            f"topic {entry.topic} has type {messages.JOINT_STATE}; say in the topic map from which effort on "
            "a pad is in contact: contacts: {topic: ..., threshold: ...}"
        )
    samples = [
        (stamp, tuple(message.name), contact_bits(message.effort, entry.threshold), received)
        for stamp, message, received in decoded.received
    ]
    return _stream(samples, entry.topic, decoded.arrivals, warnings)


def _array_stream(
    entry: ContactsTopic, bag: Sequence[BagMessage], warnings: list[str]
) -> NamedStream | None:
    """Contact bits of a topic of bare arrays, whose names and threshold the map has to give."""
    expected = (*TYPES_OF_CONTACTS, *ARRAYS)
    decoded = decode(entry.topic, bag, expected, warnings)
    msgtype = bag[0].msgtype
    if entry.names is None:
        raise RecordingError(
            f"topic {entry.topic} has type {msgtype}, which names no pads; "
            "give the pads' names in the topic map: contacts: {topic: ..., names: [...]}"
        )
    if entry.threshold is None and msgtype in _FLOAT_ARRAYS:
        raise RecordingError(
            f"topic {entry.topic} has type {msgtype}; say in the topic map from which value on a pad "
            "is in contact: contacts: {topic: ..., threshold: ...}"
        )
    threshold = 1.0 if entry.threshold is None else entry.threshold
    raw = [
        (stamp, np.array(list(message.data), dtype=np.float64))
        for stamp, message in decoded.entries
    ]
    if entry.calibration is not None:
        raw = pressures(raw, entry, threshold)
    samples = [
        (stamp, entry.names, contact_bits(values, threshold), received)
        for (stamp, values), (_, _, received) in zip(raw, decoded.received, strict=True)
    ]
    return _stream(samples, entry.topic, decoded.arrivals, warnings)


def contact_bits(values: Sequence[float] | np.ndarray, threshold: float) -> np.ndarray:
    """1 at or above the threshold, 0 below, NaN where a value is not finite."""
    array = np.array(list(values), dtype=np.float64)  # bytes too, which asarray takes for text
    return np.where(np.isfinite(array), array >= threshold, np.nan)


def _stream(
    samples: Sequence[Sample], topic: str, arrivals: Arrivals | None, warnings: list[str]
) -> NamedStream | None:
    """Samples by name. A value that is none costs its name that sample, a message without values itself."""
    usable = _with_values(samples, topic, warnings)
    publishers: dict[tuple[str, ...], list[Sample]] = {}
    for sample in usable:
        publishers.setdefault(sample[1], []).append(sample)
    pieces: dict[str, list[Piece]] = {}
    lost: dict[str, int] = {}
    for names, group in publishers.items():
        group = in_order(group, topic, warnings)
        times, known = (np.array([s[i] for s in group], dtype=np.int64) for i in (0, 3))
        table = np.array([values for _, _, values, _ in group])
        for k, name in enumerate(names):
            finite = np.isfinite(table[:, k])
            lost[name] = lost.get(name, 0) + int(np.count_nonzero(~finite))
            if finite.any():
                piece = (times[finite], table[finite, k], known[finite])
                pieces.setdefault(name, []).append(piece)
    _note_lost(lost, len(usable), topic, warnings)
    if not pieces:
        return None
    merged = {name: _merged(parts) for name, parts in pieces.items()}
    columns = {name: (times, values) for name, (times, values, _) in merged.items()}
    return NamedStream(columns, arrivals, {name: known for name, (_, _, known) in merged.items()})


def _note_lost(lost: dict[str, int], count: int, topic: str, warnings: list[str]) -> None:
    """Say which names lack values; many with the same number in one sentence."""
    by_count: dict[int, list[str]] = {}
    for name, number in lost.items():
        by_count.setdefault(number, []).append(name)
    for number, names in sorted(by_count.items(), reverse=True):
        if number:
            warnings.append(
                f"topic {topic}: {number} of {count} values of {', '.join(names)} are left out, they are "
                "not finite"
            )


def _with_values(samples: Sequence[Sample], topic: str, warnings: list[str]) -> list[Sample]:
    """The samples that have a value for each name.

    Raises:
        RecordingError: None has, though there are names and values.
    """
    usable = [sample for sample in samples if 0 < len(sample[1]) == len(sample[2])]
    if samples and not usable:
        _, names, values, _ = max(samples, key=lambda sample: len(sample[1]) + len(sample[2]))
        if names or len(values):
            raise RecordingError(
                f"topic {topic} has {len(values)} values for the {len(names)} names {', '.join(names)}"
            )
    why = "have no value for each of their names"
    note(warnings, topic, len(samples) - len(usable), len(samples), why)
    return usable


def _merged(parts: list[Piece]) -> Piece:
    """One name's column from several publishers'."""
    times, values, known = (np.concatenate(columns) for columns in zip(*parts, strict=True))
    order = np.argsort(times, kind="stable")
    return times[order], values[order], known[order]
