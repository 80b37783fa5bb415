# SPDX-License-Identifier: MIT
"""A topic of numbers by name over time: joint angles by joint, contact bits by pad."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ..exceptions import RecordingError
from . import messages
from .decode import decode, in_order, note
from .pad_calibration import pressures
from .source import BagMessage
from .topics import ContactsTopic

_FLOAT_ARRAYS = ("std_msgs/msg/Float32MultiArray", "std_msgs/msg/Float64MultiArray")
_BYTE_ARRAY = "std_msgs/msg/UInt8MultiArray"

Sample = tuple[int, tuple[str, ...], np.ndarray]  # stamp [ns], names, values


@dataclass(frozen=True)
class NamedStream:
    """Values by name, each name with its own instants, for several publishers may share a topic.

    Attributes:
        columns: For each name, stamps [ns], int64, shape (N,), increasing, and values, shape (N,).
    """

    columns: dict[str, tuple[np.ndarray, np.ndarray]]

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

    def start_ns(self, names: Sequence[str]) -> int:
        """The instant from which all the names are known [ns]."""
        return max(int(self.columns[name][0][0]) for name in names)


def read_joints(topic: str, bag: Sequence[BagMessage], warnings: list[str]) -> NamedStream | None:
    """Joint angles [rad] by joint name, or None where there are none that can be used."""
    samples = [
        (stamp, tuple(message.name), np.asarray(message.position, dtype=np.float64))
        for stamp, message in decode(topic, bag, (messages.JOINT_STATE,), warnings)
    ]
    return _stream(samples, topic, warnings)


def read_contacts(
    entry: ContactsTopic, bag: Sequence[BagMessage], warnings: list[str]
) -> NamedStream | None:
    """Contact bits (0 or 1) by pad name, or None where there are none that can be used."""
    if bag and bag[0].msgtype != messages.TACTILE_PADS:
        return _stream(_array_samples(entry, bag, warnings), entry.topic, warnings)
    samples: list[Sample] = []
    for stamp, message in decode(entry.topic, bag, (messages.TACTILE_PADS,), warnings):
        if entry.threshold is None:
            bits = np.asarray(message.contact, dtype=np.float64)
        else:
            bits = _bits(message.pressure, entry.threshold)
        samples.append((stamp, tuple(message.name), bits))
    return _stream(samples, entry.topic, warnings)


def _array_samples(
    entry: ContactsTopic, bag: Sequence[BagMessage], warnings: list[str]
) -> list[Sample]:
    """Samples of a topic of bare arrays, whose names and threshold the map has to give."""
    expected = (messages.TACTILE_PADS, *_FLOAT_ARRAYS, _BYTE_ARRAY)
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
    raw = [(stamp, np.array(list(message.data), dtype=np.float64)) for stamp, message in decoded]
    if entry.calibration is not None:
        raw = pressures(raw, entry, threshold)
    return [(stamp, entry.names, _bits(values, threshold)) for stamp, values in raw]


def _bits(values: Sequence[float] | np.ndarray, threshold: float) -> np.ndarray:
    """1 at or above the threshold, 0 below, NaN where a value is not finite."""
    array = np.array(list(values), dtype=np.float64)  # bytes too, which asarray takes for text
    return np.where(np.isfinite(array), array >= threshold, np.nan)


def _stream(samples: Sequence[Sample], topic: str, warnings: list[str]) -> NamedStream | None:
    usable = [sample for sample in samples if _is_usable(sample, topic)]
    note(warnings, topic, len(samples) - len(usable), len(samples), "are empty or not finite")
    publishers: dict[tuple[str, ...], list[Sample]] = {}
    for sample in usable:
        publishers.setdefault(sample[1], []).append(sample)
    pieces: dict[str, list[tuple[np.ndarray, np.ndarray]]] = {}
    for names, group in publishers.items():
        group = in_order(group, topic, warnings)
        times = np.array([stamp for stamp, _, _ in group], dtype=np.int64)
        table = np.array([values for _, _, values in group])
        for k, name in enumerate(names):
            pieces.setdefault(name, []).append((times, table[:, k]))
    return NamedStream({name: _merged(parts) for name, parts in pieces.items()}) if pieces else None


def _is_usable(sample: Sample, topic: str) -> bool:
    _, names, values = sample
    if len(names) != len(values):
        raise RecordingError(
            f"topic {topic} has {len(values)} values for the {len(names)} names {', '.join(names)}"
        )
    return len(names) > 0 and bool(np.isfinite(values).all())


def _merged(parts: list[tuple[np.ndarray, np.ndarray]]) -> tuple[np.ndarray, np.ndarray]:
    """One name's column from several publishers'."""
    times = np.concatenate([times for times, _ in parts])
    values = np.concatenate([values for _, values in parts])
    order = np.argsort(times, kind="stable")
    return times[order], values[order]
