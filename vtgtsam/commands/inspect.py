# SPDX-License-Identifier: MIT
"""``vtgtsam inspect``: what is in a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def inspect(
    path: Annotated[
        Path, typer.Argument(help="An .mcap file, a rosbag2 folder, or a folder of them.")
    ],
    topics: Annotated[
        Path | None, typer.Option(help="Topic map (YAML) for other people's bags.")
    ] = None,
    hand: Annotated[
        str | None, typer.Option(help="Hand instead of the recording's: a name, or MJCF or URDF.")
    ] = None,
) -> None:
    """Say what is in a recording: streams, rates, gaps, problems."""
    from ..evaluation.find import find_recordings
    from ..recording.inspect import inspect_recording

    for recording in find_recordings([path]).values():
        for line in inspect_recording(recording, hand=hand, topics=topics).lines():
            typer.echo(line)
