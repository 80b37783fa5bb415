# SPDX-License-Identifier: MIT
"""Another robot's bag as a recording of our own format, with its hand and object inside.

What is written is what was read: poses of the object in the world, at the instants of their images, logged
when they became known; contact bits in the place of raw values. Images are left out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..atomic import replacing
from ..exceptions import RecordingError
from . import names
from .named import NamedStream
from .poses import PoseStream
from .provenance import mesh_file, object_metadata
from .reader import read_recording
from .recording import Recording
from .writer import MAX_STAMP, RecordingWriter

if TYPE_CHECKING:
    import gtsam

    from ..hands.pads import PadSet
    from ..objects import ObjectModel
    from .topics import TopicMap

_RATE = 30.0  # [Hz], at which a bag without visual poses is tried


class Entry(NamedTuple):
    """A message to write.

    Attributes:
        stamp_ns: The instant it is of [ns].
        what: What it is, in words.
        write: Writes it; called with the writer and both instants [s].
        known_ns: When it became known, by the clock of the stamps [ns].
    """

    stamp_ns: int
    what: str
    write: Callable[[RecordingWriter, float, float], None]
    known_ns: int


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
    entries = sorted(entries_of(recording), key=lambda entry: (entry.known_ns, entry.stamp_ns))
    kept = [entry for entry in entries if _has_a_stamp(entry)]
    if lost := len(entries) - len(kept):
        what = "message is left out: its instant or its log time is"
        if lost > 1:
            what = "messages are left out: their instants or their log times are"
        recording.warn(
            [f"{lost} {what} not within the {MAX_STAMP} s from time 0 on that a recording can hold"]
        )
    _write(out, recording, kept)
    return Converted(dict(Counter(entry.what for entry in kept)), list(recording.warnings))


def _has_a_stamp(entry: Entry) -> bool:
    return all(0.0 <= ns / 1e9 < MAX_STAMP for ns in (entry.stamp_ns, entry.known_ns))


def _write(out: Path, recording: Recording, entries: list[Entry]) -> None:
    metadata = {
        **object_metadata(recording.object),
        "hand": recording.hand.name,
        "tracker": recording.topics.vision.topic,
        "converted_from": recording.path.name,
        names.VISUAL_COVARIANCE: "tracker",
    }
    mesh = None if recording.object.mesh is None else mesh_file(recording.object)
    with (
        replacing(out) as temporary,
        RecordingWriter(temporary, metadata, hand_xml=recording.hand.xml, mesh=mesh) as writer,
    ):
        for entry in entries:
            entry.write(writer, entry.stamp_ns / 1e9, entry.known_ns / 1e9)


def entries_of(recording: Recording) -> Iterator[Entry]:
    """All that a recording holds, stream by stream, ready to be written."""
    streams = recording.streams
    assert streams.joints is not None and streams.contacts is not None  # measurements needed them
    # The recorder's clock may be another than the robot's: what counts is how much later than joints.
    arrivals = streams.joints.arrivals
    delay_ns = 0 if arrivals is None else round(arrivals.delay * 1e9)
    yield from _joint_states(streams.joints)
    yield from _contacts(streams.contacts, recording.hand.pad_names)
    yield from _poses(streams.hand_pose, delay_ns, "poses of the hand", RecordingWriter.hand_pose)
    yield from _poses(
        streams.camera_pose, delay_ns, "poses of the camera", RecordingWriter.camera_pose
    )
    yield from _poses(streams.truth, delay_ns, "true poses", RecordingWriter.truth)
    yield from _poses(streams.estimate, delay_ns, "estimated poses", RecordingWriter.estimate)
    if streams.vision is not None:
        yield from _visual_poses(streams.vision, delay_ns)


def _joint_states(stream: NamedStream) -> Iterator[Entry]:
    for joints, times, table in _publishers(stream, tuple(stream.columns)):
        for stamp, row in zip(times.tolist(), table, strict=True):
            write = partial(_write_joints, names=joints, row=row)
            yield Entry(stamp, "joint states", write, stamp)


def _write_joints(
    writer: RecordingWriter, time: float, known: float, *, names: tuple[str, ...], row: np.ndarray
) -> None:
    writer.joint_states(time, names, row, received=known)


def _contacts(stream: NamedStream, pads: tuple[str, ...]) -> Iterator[Entry]:
    for some, times, table in _publishers(stream, pads):
        for stamp, row in zip(times.tolist(), table, strict=True):
            write = partial(_write_contacts, names=some, row=row)
            yield Entry(stamp, "contacts", write, stamp)


def _write_contacts(
    writer: RecordingWriter, time: float, known: float, *, names: tuple[str, ...], row: np.ndarray
) -> None:
    # A bag's values have a unit of their own, or none: what is sure of the pressure is the contact.
    writer.tactile(time, names, row, row > 0.5, received=known)


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
    delay_ns: int,
    what: str,
    write: Callable[[RecordingWriter, float, gtsam.Pose3, float], None],
) -> Iterator[Entry]:
    if stream is None:
        return
    for stamp, pose, known in zip(
        stream.times_ns.tolist(), stream.poses, _known_ns(stream, delay_ns), strict=True
    ):
        yield Entry(stamp, what, partial(_write_pose, write=write, pose=pose), known)


def _write_pose(
    writer: RecordingWriter,
    time: float,
    known: float,
    *,
    write: Callable[[RecordingWriter, float, gtsam.Pose3, float], None],
    pose: gtsam.Pose3,
) -> None:
    write(writer, time, pose, known)


def _known_ns(stream: PoseStream, delay_ns: int) -> list[int]:
    """When each pose became known, by the clock of the joints' stamps [ns]."""
    if stream.received_ns is None:
        return [int(stamp) for stamp in stream.times_ns]
    return [int(received) - delay_ns for received in stream.received_ns]


def _visual_poses(stream: PoseStream, delay_ns: int) -> Iterator[Entry]:
    given = any(covariance is not None for covariance in stream.covariances)
    for index, (stamp, pose, covariance, known) in enumerate(
        zip(
            stream.times_ns.tolist(),
            stream.poses,
            stream.covariances,
            _known_ns(stream, delay_ns),
            strict=True,
        )
    ):
        # All poses of a recording have a covariance or none has; zeros: unknown.
        some = np.zeros((6, 6)) if covariance is None else covariance
        write = partial(
            _write_vision,
            pose=pose,
            covariance=some if given else None,
            correlation=stream.correlation(index),
        )
        yield Entry(stamp, "visual poses", write, known)


def _write_vision(
    writer: RecordingWriter,
    time: float,
    known: float,
    *,
    pose: gtsam.Pose3,
    covariance: np.ndarray | None,
    correlation: float,
) -> None:
    if correlation > 0.0:
        writer.vision_correlation(time, correlation, received=known)
    writer.object_pose(time, pose, covariance, received=known)
