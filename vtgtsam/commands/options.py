# SPDX-License-Identifier: MIT
"""Options that several commands share."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from ..objects import ObjectModel


def positive(value: float) -> float:
    """The value, refused where it is not above 0."""
    if not (math.isfinite(value) and value > 0):
        raise typer.BadParameter(f"expected a number above 0, got {value}")
    return value


def positive_or_none(value: float | None) -> float | None:
    """The value, refused where it is not above 0; None stays."""
    return None if value is None else positive(value)


def finite_or_none(value: float | None) -> float | None:
    """The value, refused where it is infinite or no number; None stays."""
    if value is not None and not math.isfinite(value):
        raise typer.BadParameter(f"expected a finite number, got {value}")
    return value


def refuse_existing(out: Path, force: bool, *sources: Path) -> None:
    """Refuse to write over a file that nobody said to replace, or that is read.

    Raises:
        VtgtsamError: The file is there.
    """
    from ..exceptions import VtgtsamError

    for source in sources:
        if out.exists() and source.exists() and out.samefile(source):
            raise VtgtsamError(f"--out must be another file than {source}, which is read")
    if out.exists() and not force:
        raise VtgtsamError(f"{out} is there already; give another name, or --force to replace it")


Force = Annotated[bool, typer.Option("--force", help="Replace a file that is there.")]
Mesh = Annotated[Path, typer.Argument(help="Mesh file (OBJ, PLY, STL, ...).")]
Scale = Annotated[
    float,
    typer.Option(callback=positive, help="Metres per unit of the mesh file; 0.001 for mm."),
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
Calibration = Annotated[
    Path | None,
    typer.Option(help="The robot's calibration, as `vtgtsam calibrate` writes it."),
]
ObjectResolution = Annotated[
    int | None,
    typer.Option(
        "--resolution", min=2, help="Nodes of the object's distance field a side. [default: 128]"
    ),
]
ObjectSymmetry = Annotated[
    str | None,
    typer.Option(
        "--symmetry",
        help="The object's symmetry: x, y or z (any turn about that axis), none, or BOP's entry as JSON or in "
        "a file, like models_info.json#5.",
    ),
]


def object_given(
    name: str | None, resolution: int | None, symmetry: str | None
) -> ObjectModel | str | None:
    """The object that a command line names, loaded where it says more than the name."""
    if resolution is None and symmetry is None:
        return name
    if name is None:
        raise typer.BadParameter("goes with --object", param_hint="--resolution or --symmetry")
    from ..objects import load_object

    return load_object(name, resolution=resolution or 128, symmetry=symmetry)
