# SPDX-License-Identifier: MIT
"""Options that several commands share."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer


def _positive(value: float) -> float:
    if not (math.isfinite(value) and value > 0):
        raise typer.BadParameter(f"expected a number above 0, got {value}")
    return value


def positive_or_none(value: float | None) -> float | None:
    """The value, refused where it is not above 0; None stays."""
    return None if value is None else _positive(value)


def finite(value: float) -> float:
    """The value, refused where it is infinite or no number."""
    if not math.isfinite(value):
        raise typer.BadParameter(f"expected a finite number, got {value}")
    return value


Mesh = Annotated[Path, typer.Argument(help="Mesh file (OBJ, PLY, STL, ...).")]
Scale = Annotated[
    float,
    typer.Option(callback=_positive, help="Metres per unit of the mesh file; 0.001 for mm."),
]
Resolution = Annotated[int, typer.Option(min=2, help="Nodes of the distance field a side.")]
Topics = Annotated[Path | None, typer.Option(help="Topic map (YAML) for other people's bags.")]
Hand = Annotated[
    str | None,
    typer.Option(
        help="Hand instead of the recording's: the name isyhand, or an MJCF or URDF file."
    ),
]
Object = Annotated[
    str | None, typer.Option(help="Object instead of the recording's: a name or a mesh file.")
]
