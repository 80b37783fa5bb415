# SPDX-License-Identifier: MIT
"""Put poses from files into a recording, in the place of its visual poses."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import gtsam
import numpy as np

from ...atomic import replacing
from ...exceptions import RecordingError
from .. import Recording, TopicMap, messages, read_recording
from ..bags import open_source
from ..camera import image_times
from ..consistency.vision import visual_off_truth
from ..magic import kind_of
from ..pieces import METADATA, read_listed, unlisted
from ..replace import replace_topic
from ..trajectory import PoseTrajectory
from .conventions import check_conventions, check_matrices, explain_rotation
from .files import PoseFiles
from .instants import check_shift, find_numbering, known_motion
from .plausible import check_unit_and_frame, explain_offset, find_reference, in_world
from .span import check_span, inside

ADVICE = "check --frame, --scale, --latency and /camera/pose"
Count = Literal["images", "vision"]


@dataclass(frozen=True)
class Attached:
    """What was done.

    Attributes:
        count: Number of poses written.
        matched: What was matched to what: numbers or stamps to the recording's instants, in words.
        replaced: Number of visual poses that the recording had.
        warnings: Sentences on what was left out or looks wrong.
    """

    count: int
    matched: str
    replaced: int
    warnings: list[str]


def attach_vision(
    recording: str | Path,
    files: PoseFiles,
    out: str | Path,
    count: Count | None = None,
    tracker: str = "files",
    offset_is_known: bool = False,
    latency_is_known: bool = False,
    topics: TopicMap | str | Path | None = None,
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
        latency_is_known: Whether ``files.latency`` was.
        topics: Which topics hold what, for another robot's recording. The copy is read through the same
            map: its visual poses have the map's topic, latency and frame.

    Raises:
        RecordingError: The files do not fit the recording; nothing is written.
    """
    source, out = Path(recording), Path(out)
    source = _mcap_file(source)
    if out.resolve() == source.resolve():
        raise RecordingError(f"--out must be another file than the recording {source}")
    before = read_recording(source, topics=topics)
    image_times = np.empty(0) if files.table.images is None else _counted_times(before, count)
    files, times_ns, warnings = _understood(files, before, image_times, latency_is_known)
    reference = find_reference(before, times_ns / 1e9)
    poses = in_world(files, before, times_ns / 1e9)
    warnings = _warnings_of_the_rest(before) + warnings
    offset = None
    if reference is not None and not offset_is_known:
        offset = explain_offset(poses, before, reference)
        warnings += [offset] if offset else []
    if reference is not None and offset is None:
        far = _far_from_truth(poses, times_ns / 1e9, before)
        warnings += far or explain_rotation(poses, before.object, reference)
    kept = _usable(source, files, times_ns, poses, warnings)
    about = {"tracker": tracker, "tracker_files": files.path.name}
    with replacing(out) as temporary:
        stamped = [_encoded(before, stamp, T_wo) for stamp, T_wo in kept]
        topic = before.topics.vision.topic
        replace_topic(source, temporary, topic, messages.POSE, stamped, about)
    old = before.visual_poses
    return Attached(
        len(kept),
        _matched(files, before, times_ns, image_times),
        0 if old is None else len(old),
        warnings,
    )


def _mcap_file(source: Path) -> Path:
    """The one MCAP file of a recording."""
    files = [source]
    if source.is_dir():
        files = read_listed(source).files if (source / METADATA).is_file() else unlisted(source)
    if len(files) != 1 or not files[0].is_file() or kind_of(files[0]) != "mcap":
        raise RecordingError(
            f"{source} must be an .mcap file, or a rosbag2 folder with one, to attach poses to; `vtgtsam "
            "convert` makes one of any bag"
        )
    return files[0]


def _understood(
    files: PoseFiles, recording: Recording, image_times: np.ndarray, latency_is_known: bool
) -> tuple[PoseFiles, np.ndarray, list[str]]:
    """The poses in their unit, frame and numbering, their instants [ns], and what is odd about these.

    Raises:
        RecordingError: The recording says that they are of another unit, frame or instant.
    """
    times_ns = files.times_ns(image_times)
    check_span(files, times_ns, *_received(recording.path))
    check_matrices(files)
    reference = find_reference(recording, times_ns / 1e9)
    if reference is not None:
        check_conventions(files, recording, times_ns / 1e9, reference)
        check_unit_and_frame(files, recording, times_ns / 1e9, reference)
    known = None if reference is None else known_motion(recording)
    if files.table.images is not None:
        numbering = find_numbering(files, recording, image_times, known)
        files = dataclasses.replace(files, numbering=numbering)
        times_ns = files.times_ns(image_times)
    if known is None or latency_is_known:
        return files, times_ns, []
    return files, times_ns, check_shift(files, recording, times_ns / 1e9, known)


def _matched(
    files: PoseFiles, recording: Recording, times_ns: np.ndarray, image_times: np.ndarray
) -> str:
    """What was matched to what, in words."""
    start, end = recording.span
    last = f"last pose at {times_ns.max() / 1e9 - start:.2f} of {end - start:.2f} s"
    numbers = files.table.images
    if numbers is None:
        first = times_ns.min() / 1e9 - start
        return f"stamps, the first pose at {first:.2f}, the {last}"
    assert files.numbering is not None
    images = files.numbering.images(numbers)
    return (
        f"numbers {numbers.min()} to {numbers.max()} as images {images.min()} to {images.max()} of "
        f"{len(image_times)}, counted from 0; {last}"
    )


def _warnings_of_the_rest(recording: Recording) -> list[str]:
    """The recording's warnings without those on the visual poses that go."""
    vision = recording.topics.vision.topic
    old = [finding.sentence for finding in recording.findings if finding.about == vision]
    rest = [finding.sentence for finding in recording.findings if finding.about != vision]
    return [
        s for s in dict.fromkeys([*recording.warnings, *rest]) if s not in old and vision not in s
    ]


def _far_from_truth(
    poses: list[gtsam.Pose3 | None], times: np.ndarray, recording: Recording
) -> list[str]:
    known = [T is not None for T in poses]
    visual = PoseTrajectory(times[known], [T for T in poses if T is not None])
    return visual_off_truth(visual, recording.ground_truth, recording.object, ADVICE)


def _counted_times(recording: Recording, count: Count | None) -> np.ndarray:
    """Instants [s] of what the files' numbers count."""
    times = np.empty(0)
    if count != "vision":
        times = image_times(recording.path, recording.topics.images)
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
    within = inside(times_ns, *_received(source))
    found = {
        int(time): T
        for time, T, ok in zip(times_ns, poses, within, strict=True)
        if ok and T is not None
    }
    if not found:
        raise RecordingError(
            f"{files.path} holds nothing that is a pose, with the camera's pose known"
        )
    _note(warnings, int((~within).sum()), len(poses), "lie outside the recording's time")
    wrong = [T is None for T in files.poses]
    _note(warnings, sum(wrong), len(poses), "are no rotation and translation of finite numbers")
    rest = int((within & ~np.array(wrong)).sum()) - len(found)
    _note(warnings, rest, len(poses), "have another one's stamp, or come before the camera's pose")
    return sorted(found.items())


def _received(source: Path) -> tuple[int, int]:
    """When the first and the last message of a recording were received [ns]."""
    received = [message.receive_ns for message in open_source(source).messages()]
    return min(received), max(received)


def _note(warnings: list[str], count: int, total: int, why: str) -> None:
    if count:
        warnings.append(f"{count} of {total} poses are left out, they {why}")


def _encoded(recording: Recording, stamp_ns: int, T_wo: gtsam.Pose3) -> tuple[int, bytes]:
    """Stamp [ns] and message that the recording's topic map reads as this pose at this instant."""
    vision = recording.topics.vision
    pose, frame = T_wo, "world"
    if vision.frame == "camera":
        T_wc = recording.camera_pose_at(stamp_ns / 1e9)
        assert T_wc is not None  # else the map could not have been read
        pose, frame = T_wc.between(T_wo), "camera"
    stamp = stamp_ns + round(vision.latency * 1e9)
    fields = {"header": messages.header(stamp, frame), "pose": messages.pose_fields(pose)}
    return stamp, messages.encoder(messages.POSE)(fields)
