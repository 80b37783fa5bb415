# SPDX-License-Identifier: MIT
"""``vtgtsam inspect``: what is in a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from .options import Hand, Object, Topics


def inspect(
    path: Annotated[
        Path, typer.Argument(help="An .mcap file, a rosbag2 folder, or a folder of them.")
    ],
    topics: Topics = None,
    hand: Hand = None,
    object: Object = None,
) -> None:
    """Say what is in a recording: streams, rates, gaps, the object's size, problems."""
    from ..evaluation.find import find_recordings
    from ..recording.inspect import inspect_recording

    for recording in find_recordings([path]).values():
        for line in inspect_recording(recording, hand, topics, object).lines():
            typer.echo(line)
