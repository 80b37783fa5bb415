# SPDX-License-Identifier: MIT
"""``vtgtsam convert``: another robot's bag into a recording."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

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


def convert(
    bag: Annotated[
        Path, typer.Argument(help="A rosbag2 folder (MCAP or sqlite3), an .mcap or a .bag file.")
    ],
    out: Annotated[Path, typer.Option(help="The .mcap file to write.")],
    topics: Topics = None,
    hand: Hand = None,
    object: Object = None,
    resolution: ObjectResolution = None,
    symmetry: ObjectSymmetry = None,
    force: Force = False,
) -> None:
    """Turn another robot's bag into a recording with hand and object inside."""
    from ..recording.convert import convert_bag

    refuse_existing(out, force, bag)
    converted = convert_bag(
        bag, out, topics=topics, hand=hand, object=object_given(object, resolution, symmetry)
    )
    for warning in converted.warnings:
        typer.echo(f"warning: {warning}", err=True)
    counts = ", ".join(_counted(*item) for item in converted.counts.items())
    typer.echo(f"{out}: {counts}; look at it with: vtgtsam inspect {out}")


def _counted(what: str, count: int) -> str:
    """As "1 true pose"; the names are plural."""
    if count == 1:
        what = (
            what.replace("poses", "pose").replace("states", "state").replace("contacts", "contact")
        )
    return f"{count} {what}"
