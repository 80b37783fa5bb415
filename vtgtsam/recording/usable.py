# SPDX-License-Identifier: MIT
"""Whether a recording can be evaluated, and what looks wrong or odd in it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..exceptions import VtgtsamError
from ..measurement import Measurement
from .named_faults import named_faults
from .reader import read_recording
from .recording import Recording

if TYPE_CHECKING:
    from ..hands.pads import PadSet
    from ..objects import ObjectModel
    from .topics import TopicMap

LARGEST_DISTANCE = 10.0  # [m], poses further from the world's origin are probably in millimetres
SMALLEST_OBJECT = 0.01  # [m], hands hold larger ones


@dataclass
class Use:
    """What using a recording as ``vtgtsam evaluate`` does comes to.

    Attributes:
        object: The object's name and size, None where it cannot be had.
        frames: Number of frames the estimator would get at rate "vision"; None where it cannot.
        problems: What keeps it from being evaluated, or would make the results wrong.
        warnings: What may be right but seldom is.
        notes: What is not wrong but worth knowing.
        vision_topic: The visual poses' topic, None where the recording cannot be read.
        topics: Names of the topics that are read.
    """

    object: str | None = None
    frames: int | None = None
    problems: list[str] = field(default_factory=list)
    warnings: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)
    vision_topic: str | None = None
    topics: tuple[str, ...] = ()


def try_to_use(
    path: str | Path,
    hand: PadSet | str | Path | None,
    object: ObjectModel | str | Path | None,
    topics: TopicMap | str | Path | None,
) -> Use:
    """Do what an evaluation does before it estimates; arguments as for ``read_recording``."""
    use = Use()
    try:
        recording = read_recording(path, hand=hand, object=object, topics=topics)
    except (VtgtsamError, ValueError, OSError) as error:
        use.problems.append(str(error))
        return use
    use.vision_topic = recording.topics.vision.topic
    use.topics = tuple(recording.topics.used())
    use.notes += _notes(recording)
    use.warnings += [found.sentence for found in recording.findings if found.level == "warning"]
    refused = [*_use_object(recording, use), *_use_streams(recording, use)]
    found = [found.sentence for found in recording.findings if found.level == "problem"]
    problems = [s for s in [*recording.warnings, *found] if s not in use.warnings]
    use.problems += dict.fromkeys([*problems, *_far_poses(recording), *refused])
    if use.frames and use.object is not None and not (use.problems or use.warnings):
        use.warnings += named_faults(recording)
    return use


def _use_object(recording: Recording, use: Use) -> Iterator[str]:
    """Notes the object's size; yields why there is none."""
    try:
        obj = recording.object
    except (VtgtsamError, ValueError, OSError) as error:
        yield str(error)
        return
    extents = obj.sdf.upper - obj.sdf.lower if obj.mesh is None else obj.mesh.extents
    use.object = f"{obj.name}: {_millimetres(extents)}"
    if max(extents) < SMALLEST_OBJECT:
        use.warnings.append(
            f"{use.object} is very small for a hand; if it is larger, say how many metres a unit of "
            "its mesh is: 'object: {mesh: ..., scale: ...}' in a topic map, or object_scale in the "
            "recording's metadata"
        )


def _millimetres(extents: Sequence[float] | np.ndarray) -> str:
    mm = [1e3 * float(x) for x in extents]
    return " x ".join(f"{x:.0f}" if min(mm) >= 10 else f"{x:.1f}" for x in mm) + " mm"


def _use_streams(recording: Recording, use: Use) -> Iterator[str]:
    """Notes frames and contacts; yields why there are none."""
    from .frames import evaluation_frames

    try:
        measurements = recording.measurements()
        evaluated = len(evaluation_frames(recording))
    except (VtgtsamError, ValueError, OSError) as error:
        yield str(error)
        return
    use.frames = len(measurements)
    if evaluated > use.frames:
        use.notes.append(
            f"evaluate has {evaluated} frames, for it goes on at the usual rate while the tracker is "
            f"silent: {evaluated - use.frames} of them are without a visual pose"
        )
    use.notes += _contact_notes(measurements, recording.hand.pad_names)


def _notes(recording: Recording) -> Iterator[str]:
    if recording.ground_truth is None:
        yield "no true poses, so that errors cannot be computed"
    if recording.camera_pose is None:
        yield "no camera pose, so that results cannot be given in the camera frame"


def _far_poses(recording: Recording) -> Iterator[str]:
    trajectories = {"visual": recording.visual_poses, "true": recording.ground_truth}
    for what, trajectory in trajectories.items():
        if trajectory is None:
            continue
        distance = max(float(np.linalg.norm(pose.translation())) for pose in trajectory.poses)
        if distance > LARGEST_DISTANCE:
            yield (
                f"{what} poses lie up to {distance:.0f} m from the world's origin; "
                "if they are in millimetres, write them in metres"
            )


def _contact_notes(measurements: list[Measurement], pad_names: Sequence[str]) -> Iterator[str]:
    if not measurements:
        return
    contacts = np.array([m.contacts for m in measurements], dtype=bool)
    if not contacts.any():
        yield "no pad is in contact in any frame"
    stuck = [pad_names[k] for k in np.flatnonzero(contacts.all(axis=0)).tolist()]
    if stuck:
        yield f"in contact in every frame: {', '.join(stuck)}"
