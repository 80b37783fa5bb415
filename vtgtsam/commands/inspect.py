# SPDX-License-Identifier: MIT
"""``vtgtsam inspect``: what is in a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .options import Hand, Object, ObjectResolution, ObjectSymmetry, Topics, object_given

HAS_PROBLEMS = 1


def inspect(
    path: Annotated[
        Path, typer.Argument(help="An .mcap file, a rosbag2 folder, or a folder of them.")
    ],
    topics: Topics = None,
    hand: Hand = None,
    object: Object = None,
    resolution: ObjectResolution = None,
    symmetry: ObjectSymmetry = None,
) -> None:
    """Say what is in a recording: streams, rates, gaps, the object's size, problems.

    The exit code is 1 where there is a problem; warnings and notes are none.
    """
    from ..evaluation.find import find_recordings
    from ..recording.inspect import inspect_recording

    sound = True
    shown = object_given(object, resolution, symmetry)
    for recording in find_recordings([path]).values():
        found = inspect_recording(recording, hand, topics, shown)
        sound &= not found.problems
        for line in found.lines():
            typer.echo(line)
    if not sound:
        raise typer.Exit(HAS_PROBLEMS)
