# SPDX-License-Identifier: MIT
"""``vtgtsam calibrate``: a robot's joint zeros and its camera, from grasps that it made."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Annotated

import typer

from .options import Force, Topics, refuse_existing


def calibrate(
    paths: Annotated[
        list[Path],
        typer.Argument(
            metavar="PATHS",
            help="Recordings of one robot's grasps: .mcap files, rosbag2 folders, or folders of them.",
        ),
    ],
    out: Annotated[
        Path, typer.Option(help="The YAML file to write; a picture is written beside it.")
    ],
    prior: Annotated[
        Path | None, typer.Option(help="An earlier calibration of this robot to go on from.")
    ] = None,
    topics: Topics = None,
    force: Force = False,
) -> None:
    """Find where a robot's camera and its joints' zeros are, from grasps of known objects.

    Five to ten grasps of different objects, in which all fingers and the palm touch, are enough.
    """
    from ..atomic import write_text
    from ..calibration.calibrate import run
    from ..calibration.figure import draw
    from ..calibration.printing import text_of

    picture = out.with_suffix(".png")
    for file in (out, picture):
        refuse_existing(file, force, *paths, *(() if prior is None else (prior,)))
    result = run(paths, prior, topics, progress=_tell)
    write_text(out, result.calibration.text())
    draw(result, picture)
    typer.echo(text_of(result))
    typer.echo(f"wrote {out} and {picture}; use it with: vtgtsam evaluate ... --calibration {out}")


def _tell(stage: str, done: int, total: int) -> None:
    """Progress on one line of a terminal, or a line a step elsewhere."""
    if sys.stderr.isatty():
        end = "\n" if done == total else ""
        print(f"\r{stage}: {done} of {total} recordings ", end=end, file=sys.stderr, flush=True)
    else:
        print(f"{stage}: {done} of {total} recordings", file=sys.stderr, flush=True)
