# SPDX-License-Identifier: MIT
"""``vtgtsam sdf``: the distance field of a mesh."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Annotated

import typer

from .options import Force, Mesh, Resolution, Scale, refuse_existing


def sdf(
    mesh: Mesh,
    out: Annotated[Path, typer.Option(help="File to write, .npz.")],
    scale: Scale = 1.0,
    resolution: Resolution = 128,
    force: Force = False,
) -> None:
    """Build the signed distance field of a mesh; `GridSdf.load` reads the file."""
    from ..mesh.reading import read_mesh
    from ..sdf.build import build_sdf

    refuse_existing(out, force, mesh)
    surface = read_mesh(mesh)
    surface.apply_scale(scale)
    with warnings.catch_warnings(record=True) as problems:
        warnings.simplefilter("always")
        grid = build_sdf(surface, resolution)
    for problem in problems:
        typer.echo(f"warning: {problem.message}", err=True)
    grid.save(out)
    side = " x ".join(str(count) for count in grid.values.shape)
    typer.echo(f"{out}: {side} nodes, {float(grid.spacing.max()) * 1e3:.2f} mm apart")
