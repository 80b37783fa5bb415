# SPDX-License-Identifier: MIT
"""``vtgtsam export-lerobot``: an evaluation's estimates as a LeRobot dataset."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def export_lerobot(
    results: Annotated[Path, typer.Argument(help="Folder that `vtgtsam evaluate` wrote.")],
    out: Annotated[Path, typer.Option(help="Folder of the dataset, which is made.")],
    method: Annotated[
        str | None,
        typer.Option(help="Whose estimates. [default: with memory, else the last one's by name]"),
    ] = None,
    fps: Annotated[
        int | None,
        typer.Option(min=1, help="Frames a second. [default: as the first sequence's estimates]"),
    ] = None,
    task: Annotated[
        str, typer.Option(help="What is done in an episode; {object} becomes its name.")
    ] = "hold the {object}",
) -> None:
    """Write estimates as a LeRobot v3.0 dataset, an episode a sequence."""
    from ..extras import require

    require("evaluate", "an export needs", "pyarrow")
    from ..evaluation.lerobot import export_lerobot

    written = export_lerobot(results, out, method, fps, task)
    typer.echo(
        f"{out}: {written.episodes} episodes, {written.frames} frames at {written.fps} Hz, "
        f"estimates by {written.method}"
    )
