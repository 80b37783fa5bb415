# SPDX-License-Identifier: MIT
"""``vtgtsam view``: a recording in Rerun."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .options import Hand, Object, ObjectResolution, ObjectSymmetry, Topics, object_given


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
) -> None:
    """Show a recording in Rerun: hand, pads, object at truth and estimates, images, errors."""
    from ..evaluation.find import find_recordings
    from ..exceptions import RecordingError
    from ..recording import read_recording
    from ..viz.draw import draw_recording, recording_layout
    from ..viz.stream import check_display, open_stream
    from ..viz.tracks import evaluated_tracks, recorded_tracks

    if save is None:
        check_display()  # before the work
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
    stream = open_stream(name, arrangement, save=save, spawn=save is None)
    draw_recording(stream, recording, frames, tracks)
    stream.flush()
    if save is not None:
        typer.echo(f"{save}: {len(frames)} frames; open it with: rerun {save}")
