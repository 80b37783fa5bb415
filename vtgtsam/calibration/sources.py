# SPDX-License-Identifier: MIT
"""The recordings that a calibration may be made from: read, each once, all of one robot."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..evaluation.find import find_recordings
from ..exceptions import CalibrationError, VtgtsamError
from ..measurement import Measurement
from ..recording import Recording, TopicMap, read_recording
from ..recording.frames import evaluation_frames
from .calibration import Calibration
from .robot import Robot

PathLike = str | os.PathLike[str]
Recordings = PathLike | Recording | Iterable[PathLike | Recording]
Progress = Callable[[str, int, int], None]


@dataclass(frozen=True, eq=False)
class Source:
    """A recording that is of use as far as one can see without tracking.

    Attributes:
        name: What it is called.
        digest: What tells it from others.
        run: What tells the live run that made it from others; empty where none did.
        recording: The recording.
        frames: Its measurements.
    """

    name: str
    digest: str
    run: str
    recording: Recording
    frames: Sequence[Measurement]


def read_sources(
    recordings: Recordings, topics: TopicMap | None, prior: Calibration | None, tell: Progress
) -> tuple[list[Source], dict[str, str]]:
    """The recordings, and why some were left out.

    Args:
        recordings: Recordings, or their paths, or folders that are searched for such.
        topics: Topic map of other people's bags.
        prior: An earlier calibration; what it was made from is left out.
        tell: Told how far the reading is.

    Raises:
        CalibrationError: There are none, or none is of use.
        VtgtsamError: A path does not exist.
    """
    named = _named(recordings)
    sources: list[Source] = []
    left_out: dict[str, str] = {}
    seen = dict.fromkeys(() if prior is None else prior.made_from, "the prior")
    for count, (name, each) in enumerate(named.items(), 1):
        try:
            source = _source(name, each, topics)
        except (VtgtsamError, ValueError, OSError) as error:
            left_out[name] = " ".join(str(error).split())
        else:
            known = seen.get(source.digest) or seen.get(source.run)
            if known:
                left_out[name] = f"the same as {known}"
            else:
                seen[source.digest] = name
                sources.append(source)
        tell("reading", count, len(named))
    if not sources:
        raise none_of_use(left_out)
    return sources, left_out


def none_of_use(left_out: dict[str, str]) -> CalibrationError:
    """The error that there is nothing to calibrate from, and why."""
    reasons = "; ".join(f"{name}: {reason}" for name, reason in left_out.items())
    return CalibrationError(f"no recording is of use: {reasons}")


def _named(recordings: Recordings) -> dict[str, Recording | Path]:
    """What was given, by name."""
    if isinstance(recordings, str | os.PathLike | Recording):
        recordings = [recordings]
    given = list(recordings)
    paths = [path for path in given if not isinstance(path, Recording)]
    named: dict[str, Recording | Path] = dict(find_recordings(paths)) if paths else {}
    named |= {str(each.path): each for each in given if isinstance(each, Recording)}
    if not named:
        raise CalibrationError(
            "no recordings given; name .mcap files, rosbag2 folders, or folders of them"
        )
    return named


def _source(name: str, given: Recording | Path, topics: TopicMap | None) -> Source:
    recording = given if isinstance(given, Recording) else read_recording(given, topics=topics)
    recording.object  # noqa: B018  reads it, so that what is wrong with it is known now
    frames = evaluation_frames(recording)
    return Source(name, _digest(recording), run_of(recording.info), recording, frames)


def run_of(metadata: Mapping[str, str]) -> str:
    """What tells a live run from others, as ``Calibration.made_from`` has it; empty where a recording is of none."""
    started = metadata.get("started", "")
    return f"run of {started}" if started else ""


def _digest(recording: Recording) -> str:
    """What tells a recording from others: a hash of its instants, joints and visual poses."""
    digest = hashlib.sha256()
    streams = recording.streams
    for stream in (streams.joints, streams.contacts, streams.vision):
        if stream is not None:
            digest.update(np.asarray(stream.times_ns).tobytes())
    if streams.vision is not None:
        digest.update(np.array([pose.translation() for pose in streams.vision.poses]).tobytes())
    return digest.hexdigest()[:16]


def one_robot(sources: Sequence[Source], prior: Calibration | None) -> Robot:
    """The robot that all recordings are of.

    Raises:
        CalibrationError: They are of several, or of another than the prior.
    """
    if prior is not None:
        robot, whose = prior.robot, "the prior"
    else:
        first = sources[0]
        try:
            robot, whose = Robot.of(first.recording), first.name
        except CalibrationError as error:
            raise CalibrationError(f"{first.name}: {error}") from None
    for source in sources:
        try:
            robot.check(source.recording, whose)
        except CalibrationError as error:
            raise CalibrationError(
                f"{source.name}: {error}; calibrate one robot with one camera at a time"
            ) from None
    return robot
