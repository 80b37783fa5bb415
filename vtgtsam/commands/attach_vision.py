# SPDX-License-Identifier: MIT
"""``vtgtsam attach-vision``: another program's visual poses into a recording."""

from __future__ import annotations

import math
from enum import StrEnum
from pathlib import Path
from typing import Annotated

import typer

from .options import Force, Topics, finite_or_none, positive, positive_or_none, refuse_existing


class FrameName(StrEnum):
    """Frames that poses are given in."""

    world = "world"
    camera = "camera"


class CountName(StrEnum):
    """What numbers of images count."""

    images = "images"
    vision = "vision"


def attach_vision(
    recording: Annotated[Path, typer.Argument(help="An .mcap file, or a rosbag2 folder with one.")],
    poses: Annotated[
        Path,
        typer.Argument(
            help="A folder of 4x4 matrices, one .txt an image (FoundationPose's ob_in_cam), a BOP csv, "
            "or a TUM file.",
        ),
    ],
    out: Annotated[Path, typer.Option(help="The .mcap file to write.")],
    scale: Annotated[
        float | None,
        typer.Option(
            callback=positive_or_none,
            help="Metres per unit of the translations; 0.001 for mm. [default: 1, for BOP 0.001]",
        ),
    ] = None,
    latency: Annotated[
        float | None,
        typer.Option(
            callback=finite_or_none,
            help="How long after its image a pose is stamped [s]. [default: 0]",
        ),
    ] = None,
    frame: Annotated[
        FrameName | None,
        typer.Option(help="Frame of the poses. [default: camera, for TUM world]"),
    ] = None,
    offset: Annotated[
        str | None,
        typer.Option(
            help="Origin of the mesh that the other program used, in the object frame: x,y,z [m], "
            "or 'file' (the mesh file's own), or 'center' (of its bounding box)."
        ),
    ] = None,
    count: Annotated[
        CountName | None,
        typer.Option(
            help="What the numbers of images count: the recording's images, or (as in what `vtgtsam "
            "evaluate` exports) its visual poses. [default: images, if there are any]"
        ),
    ] = None,
    first: Annotated[
        int | None,
        typer.Option(min=0, help="The image of the first numbered pose, counted from 0."),
    ] = None,
    every: Annotated[
        int | None,
        typer.Option(min=1, help="How many images each next number is further on. [default: 1]"),
    ] = None,
    time_scale: Annotated[
        float,
        typer.Option(
            callback=positive, help="Seconds per unit of a TUM file's stamps; 1e-9 for ns."
        ),
    ] = 1.0,
    scene: Annotated[int | None, typer.Option(help="scene_id in a BOP csv.")] = None,
    object_id: Annotated[int | None, typer.Option(help="obj_id in a BOP csv.")] = None,
    tracker: Annotated[str, typer.Option(help="What to call the tracker in tables.")] = "files",
    topics: Topics = None,
    force: Force = False,
) -> None:
    """Put poses of another program into a copy of a recording, in the place of its visual poses.

    Poses in the wrong unit or frame, of a mesh with another origin, or for other instants are noticed and
    explained.
    """
    from ..recording.pose_files import PoseFiles
    from ..recording.pose_files.attach import attach_vision as attach
    from ..recording.pose_files.numbering import Numbering

    refuse_existing(out, force, recording, poses)
    files = PoseFiles.read(
        poses,
        scale=scale,
        frame=None if frame is None else frame.value,
        offset=_offset(offset, recording, topics),
        latency=latency or 0.0,
        scene=scene,
        obj=object_id,
        numbering=None if first is None and every is None else Numbering(first or 0, every or 1),
        time_scale=time_scale,
    )
    done = attach(
        recording,
        files,
        out,
        count=None if count is None else count.value,
        tracker=tracker,
        offset_is_known=offset is not None,
        latency_is_known=latency is not None,
        topics=topics,
    )
    for warning in done.warnings:
        typer.echo(f"warning: {warning}", err=True)
    typer.echo(
        f"{out}: {done.count} visual poses from {poses} ({files.table.kind}, {files.frame} frame, "
        f"{files.scale:g} m a unit) in the place of {done.replaced}; "
        f"{done.matched}"
    )


def _offset(text: str | None, recording: Path, topics: Path | None) -> tuple[float, ...]:
    if text is None:
        return (0.0, 0.0, 0.0)
    if text in ("file", "center"):
        from ..recording import read_recording
        from ..recording.pose_files.plausible import origins

        return tuple(origins(read_recording(recording, topics=topics).object)[text][0].tolist())
    try:
        numbers = tuple(float(word) for word in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != 3 or not all(map(math.isfinite, numbers)):
        raise typer.BadParameter(
            f"expected x,y,z [m], 'file' or 'center', got {text!r}", param_hint="--offset"
        )
    return numbers
