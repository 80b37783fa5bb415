# SPDX-License-Identifier: MIT
"""``vtgtsam view``: a recording in Rerun."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from .options import (
    Force,
    Hand,
    Object,
    ObjectResolution,
    ObjectSymmetry,
    Topics,
    object_given,
    refuse_existing,
)

if TYPE_CHECKING:
    from rerun import RecordingStream

    from ..measurement import Measurement
    from ..recording import Recording
    from ..viz.tracks import Track


def view(
    path: Annotated[Path, typer.Argument(help="An .mcap file, a rosbag2 folder, or a .bag file.")],
    estimates: Annotated[
        Path | None, typer.Option(help="Folder that `vtgtsam evaluate` wrote: shows its methods.")
    ] = None,
    save: Annotated[
        Path | None, typer.Option(help="Write this .rrd file instead of opening the viewer.")
    ] = None,
    topics: Topics = None,
    hand: Hand = None,
    object: Object = None,
    resolution: ObjectResolution = None,
    symmetry: ObjectSymmetry = None,
    force: Force = False,
) -> None:
    """Show a recording in Rerun: hand, pads, object at truth and estimates, images, errors."""
    from ..atomic import replacing
    from ..evaluation.find import find_recordings
    from ..exceptions import RecordingError, VtgtsamError
    from ..recording import read_recording
    from ..viz.draw import recording_layout
    from ..viz.stream import check_display, check_name, open_stream
    from ..viz.tracks import evaluated_tracks, recorded_tracks

    if save is None:
        check_display()  # before the work
    else:
        refuse_existing(save, force, path)
        check_name(save)
        if not save.parent.is_dir():
            raise VtgtsamError(f"cannot write {save}: there is no folder {save.parent}")
    found = find_recordings([path])
    if len(found) > 1:
        raise RecordingError(
            f"{path} holds {len(found)} recordings; give one of them: "
            f"{', '.join(str(file) for file in list(found.values())[:3])}, ..."
        )
    ((name, file),) = found.items()
    recording = read_recording(
        file, hand=hand, object=object_given(object, resolution, symmetry), topics=topics
    )
    if estimates is None:
        frames, tracks = recorded_tracks(recording)
    else:
        frames, tracks = evaluated_tracks(recording, estimates)
    arrangement = recording_layout(recording, frames, tracks)
    if save is None:
        _draw(open_stream(name, arrangement, spawn=True), recording, frames, tracks)
    else:
        with replacing(save) as temporary:
            _draw(open_stream(name, arrangement, save=temporary), recording, frames, tracks)
        typer.echo(f"{save}: {len(frames)} frames; open it with: rerun {save}")


def _draw(
    stream: RecordingStream, recording: Recording, frames: list[Measurement], tracks: list[Track]
) -> None:
    from ..exceptions import VtgtsamError
    from ..input.plain import plain
    from ..viz.draw import draw_recording

    draw_recording(stream, recording, frames, tracks)
    try:
        stream.flush()
    except RuntimeError as error:
        raise VtgtsamError(
            f"Rerun cannot write any more ({plain(error)}); is the disk full?"
        ) from None
    finally:
        stream.disconnect()
