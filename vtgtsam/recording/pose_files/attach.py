# SPDX-License-Identifier: MIT
"""Put poses from files into a recording, in the place of its visual poses."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import gtsam
import numpy as np

from ...atomic import replacing
from ...exceptions import RecordingError, VtgtsamError
from .. import Recording, messages, names, read_recording
from ..bags import open_source
from ..camera import image_times
from ..replace import replace_topic
from ..trajectory import PoseTrajectory
from ..visual_check import visual_off_truth
from .files import PoseFiles
from .plausible import check_unit_and_frame, explain_offset, find_reference, in_world
from .quaternions import check_quaternion_order

ADVICE = "check --frame, --scale, --latency and /camera/pose"
Count = Literal["images", "vision"]

OUTSIDE_NS = 10**9  # [ns], poses that far before or after a recording are of another one


@dataclass(frozen=True)
class Attached:
    """What was done.

    Attributes:
        count: Number of poses written.
        replaced: Number of visual poses that the recording had.
        warnings: Sentences on what was left out or looks wrong.
    """

    count: int
    replaced: int
    warnings: list[str]


def attach_vision(
    recording: str | Path,
    files: PoseFiles,
    out: str | Path,
    count: Count | None = None,
    tracker: str = "files",
    offset_is_known: bool = False,
) -> Attached:
    """Write a copy of a recording whose visual poses are those of files.

    Args:
        recording: An MCAP file.
        files: The poses.
        out: The file to write; an existing one is replaced.
        count: What the files' numbers count: "images", or "vision", the visual poses that the recording
            has (as in what ``vtgtsam evaluate`` exports); None: images where there are any.
        tracker: What the copy calls the tracker.
        offset_is_known: Whether ``files.offset`` was said to be right, so that it is not questioned.

    Raises:
        RecordingError: The files do not fit the recording; nothing is written.
    """
    source, out = Path(recording), Path(out)
    if source.is_dir() or source.suffix != ".mcap":
        raise RecordingError(f"{source} must be an .mcap file to attach poses to")
    if out.resolve() == source.resolve():
        raise RecordingError(f"--out must be another file than the recording {source}")
    before = read_recording(source)
    numbered = files.table.stamps_ns is None
    times_ns = files.times_ns(_counted_times(before, count) if numbered else np.empty(0))
    reference = find_reference(before, times_ns / 1e9)
    if reference is not None:
        check_unit_and_frame(files, before, times_ns / 1e9, reference)
        check_quaternion_order(files, before, times_ns / 1e9, reference)
    poses = in_world(files, before, times_ns / 1e9)
    warnings = _warnings_of_the_rest(before)
    offset = None
    if reference is not None and not offset_is_known:
        offset = explain_offset(poses, before, reference)
        warnings += [offset] if offset else []
    if reference is not None and offset is None:
        warnings += _far_from_truth(poses, times_ns / 1e9, before)
    kept = _usable(source, files, times_ns, poses, warnings)
    about = {"tracker": tracker, "tracker_files": files.path.name}
    with replacing(out) as temporary:
        stamped = [(stamp, _encoded(stamp, T_wo)) for stamp, T_wo in kept]
        replace_topic(source, temporary, names.VISION, messages.POSE, stamped, about)
    old = before.visual_poses
    return Attached(len(kept), 0 if old is None else len(old), warnings)


def _warnings_of_the_rest(recording: Recording) -> list[str]:
    """The recording's warnings without that on the visual poses that go."""
    try:
        old = visual_off_truth(recording.visual_poses, recording.ground_truth, recording.object)
    except VtgtsamError:  # no object: they were not judged
        old = []
    return [sentence for sentence in recording.warnings if sentence not in old]


def _far_from_truth(
    poses: list[gtsam.Pose3 | None], times: np.ndarray, recording: Recording
) -> list[str]:
    known = [T is not None for T in poses]
    visual = PoseTrajectory(times[known], [T for T in poses if T is not None])
    return visual_off_truth(visual, recording.ground_truth, recording.object, ADVICE)


def _counted_times(recording: Recording, count: Count | None) -> np.ndarray:
    """Instants [s] of what the files' numbers count."""
    times = np.empty(0) if count == "vision" else image_times(recording.path)
    if len(times) == 0 and count != "images" and recording.visual_poses is not None:
        times = recording.visual_poses.times
    if len(times) == 0:
        raise RecordingError(
            f"{recording.path} has no {count or 'images'} that the poses' numbers could count; "
            "give a TUM file, whose lines have stamps"
        )
    return times


def _usable(
    source: Path,
    files: PoseFiles,
    times_ns: np.ndarray,
    poses: list[gtsam.Pose3 | None],
    warnings: list[str],
) -> list[tuple[int, gtsam.Pose3]]:
    """The poses that are poses and of this recording's time, by stamp; one for each."""
    received = [message.receive_ns for message in open_source(source).messages()]
    start, end = min(received), max(received)
    inside = (times_ns >= max(start - OUTSIDE_NS, 0)) & (times_ns <= end + OUTSIDE_NS)
    if not inside.any():
        raise RecordingError(
            f"the poses in {files.path} are from {times_ns.min() / 1e9:.2f} to "
            f"{times_ns.max() / 1e9:.2f} s, the recording from {start / 1e9:.2f} to "
            f"{end / 1e9:.2f} s; are the stamps of one clock, and --latency in seconds?"
        )
    found = {
        int(time): T
        for time, T, ok in zip(times_ns, poses, inside, strict=True)
        if ok and T is not None
    }
    if not found:
        raise RecordingError(
            f"{files.path} holds nothing that is a pose, with the camera's pose known"
        )
    _note(warnings, int((~inside).sum()), len(poses), "lie outside the recording's time")
    wrong = [T is None for T in files.poses]
    _note(warnings, sum(wrong), len(poses), "are no rotation and translation of finite numbers")
    rest = int((inside & ~np.array(wrong)).sum()) - len(found)
    _note(warnings, rest, len(poses), "have another one's stamp, or come before the camera's pose")
    return sorted(found.items())


def _note(warnings: list[str], count: int, total: int, why: str) -> None:
    if count:
        warnings.append(f"{count} of {total} poses are left out, they {why}")


def _encoded(stamp: int, T_wo: gtsam.Pose3) -> bytes:
    fields = {"header": messages.header(stamp, "world"), "pose": messages.pose_fields(T_wo)}
    return messages.encoder(messages.POSE)(fields)
