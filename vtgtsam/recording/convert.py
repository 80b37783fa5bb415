# SPDX-License-Identifier: MIT
"""Another robot's bag as a recording of our own format, with its hand and object inside.

What is written is what was read: poses of the object in the world, at the instants of their images;
contact bits in the place of raw values. Images are left out.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..exceptions import RecordingError
from .named import NamedStream
from .poses import PoseStream
from .provenance import mesh_file, object_metadata
from .reader import read_recording
from .recording import Recording
from .writer import RecordingWriter

if TYPE_CHECKING:
    import gtsam

    from ..hands.pads import PadSet
    from ..objects import ObjectModel
    from .topics import TopicMap

_RATE = 30.0  # [Hz], at which a bag without visual poses is tried

Entry = tuple[
    int, str, Callable[[RecordingWriter, float], None]
]  # stamp [ns], what, how to write it


@dataclass(frozen=True)
class Converted:
    """What became of a bag.

    Attributes:
        counts: Number of messages written, by what they are.
        warnings: Sentences on what could not be read or used.
    """

    counts: dict[str, int]
    warnings: list[str]


def convert_bag(
    bag: str | Path,
    out: str | Path,
    topics: TopicMap | str | Path | None = None,
    hand: PadSet | str | Path | None = None,
    object: ObjectModel | str | Path | None = None,
) -> Converted:
    """Write a bag as a recording that ``vtgtsam evaluate`` reads without a map.

    Args:
        bag: As ``read_recording`` takes it.
        out: The .mcap file to write; it appears when it is complete.
        topics: Which topics hold what, or the path of such a map.
        hand: The hand, where the map does not say it.
        object: The object, where the map does not say it.

    Raises:
        RecordingError: The bag cannot be used, or ``out`` is the bag itself.
    """
    out = Path(out)
    if out.exists() and out.samefile(bag):
        raise RecordingError(f"{out} is the bag itself; give another file to write to")
    recording = read_recording(bag, hand=hand, object=object, topics=topics)
    # Whatever keeps the estimator from using the bag is an error here, before anything is written.
    recording.measurements(rate=_RATE if recording.visual_poses is None else "vision")
    entries = sorted(entries_of(recording), key=lambda entry: entry[0])
    kept = [entry for entry in entries if entry[0] >= 0]
    if len(kept) < len(entries):
        recording.warn(
            [f"{len(entries) - len(kept)} messages are left out, which belong before time 0"]
        )
    _write(out, recording, kept)
    return Converted(dict(Counter(what for _, what, _ in kept)), list(recording.warnings))


def _write(out: Path, recording: Recording, entries: list[Entry]) -> None:
    metadata = {
        **object_metadata(recording.object),
        "hand": recording.hand.name,
        "tracker": recording.topics.vision.topic,
        "converted_from": recording.path.name,
    }
    mesh = None if recording.object.mesh is None else mesh_file(recording.object)
    part = out.with_name(f".{out.name}.part")
    try:
        with RecordingWriter(part, metadata, hand_xml=recording.hand.xml, mesh=mesh) as writer:
            for stamp, _, write in entries:
                write(writer, stamp / 1e9)
        os.replace(part, out)
    finally:
        part.unlink(missing_ok=True)


def entries_of(recording: Recording) -> Iterator[Entry]:
    """All that a recording holds, stream by stream, ready to be written."""
    streams = recording.streams
    assert streams.joints is not None and streams.contacts is not None  # measurements needed them
    yield from _joint_states(streams.joints)
    yield from _contacts(streams.contacts, recording.hand.pad_names)
    yield from _poses(streams.hand_pose, "poses of the hand", RecordingWriter.hand_pose)
    yield from _poses(streams.camera_pose, "poses of the camera", RecordingWriter.camera_pose)
    yield from _poses(streams.truth, "true poses", RecordingWriter.truth)
    yield from _poses(streams.estimate, "estimated poses", RecordingWriter.estimate)
    if streams.vision is not None:
        yield from _visual_poses(streams.vision)


def _joint_states(stream: NamedStream) -> Iterator[Entry]:
    for names, times, table in _publishers(stream, tuple(stream.columns)):
        for stamp, row in zip(times.tolist(), table, strict=True):
            yield stamp, "joint states", _joint_state(names, row)


def _joint_state(
    names: tuple[str, ...], row: np.ndarray
) -> Callable[[RecordingWriter, float], None]:
    return lambda writer, time: writer.joint_states(time, names, row)


def _contacts(stream: NamedStream, pads: tuple[str, ...]) -> Iterator[Entry]:
    for names, times, table in _publishers(stream, pads):
        for stamp, row in zip(times.tolist(), table, strict=True):
            yield stamp, "contacts", _pad_state(names, row)


def _pad_state(names: tuple[str, ...], row: np.ndarray) -> Callable[[RecordingWriter, float], None]:
    # A bag's values have a unit of their own, or none: what is sure of the pressure is the contact.
    return lambda writer, time: writer.tactile(time, names, row, row > 0.5)


def _publishers(
    stream: NamedStream, names: tuple[str, ...]
) -> Iterator[tuple[tuple[str, ...], np.ndarray, np.ndarray]]:
    """Names that always came together, their stamps (N,) and values (N, names)."""
    groups: dict[bytes, list[str]] = {}
    for name in names:
        groups.setdefault(stream.columns[name][0].tobytes(), []).append(name)
    for group in groups.values():
        times = stream.columns[group[0]][0]
        yield tuple(group), times, np.column_stack([stream.columns[name][1] for name in group])


def _poses(
    stream: PoseStream | None,
    what: str,
    write: Callable[[RecordingWriter, float, gtsam.Pose3], None],
) -> Iterator[Entry]:
    if stream is None:
        return
    for stamp, pose in zip(stream.times_ns.tolist(), stream.poses, strict=True):
        yield stamp, what, _pose(write, pose)


def _pose(
    write: Callable[[RecordingWriter, float, gtsam.Pose3], None], pose: gtsam.Pose3
) -> Callable[[RecordingWriter, float], None]:
    return lambda writer, time: write(writer, time, pose)


def _visual_poses(stream: PoseStream) -> Iterator[Entry]:
    given = any(covariance is not None for covariance in stream.covariances)
    for stamp, pose, covariance in zip(
        stream.times_ns.tolist(), stream.poses, stream.covariances, strict=True
    ):
        # All poses of a recording have a covariance or none has; zeros: unknown.
        known = np.zeros((6, 6)) if covariance is None else covariance
        yield stamp, "visual poses", _visual_pose(pose, known if given else None)


def _visual_pose(
    pose: gtsam.Pose3, covariance: np.ndarray | None
) -> Callable[[RecordingWriter, float], None]:
    return lambda writer, time: writer.object_pose(time, pose, covariance)
