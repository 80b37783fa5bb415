# SPDX-License-Identifier: MIT
"""``vtgtsam sdf``: the distance field of a mesh."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def sdf(
    mesh: Annotated[Path, typer.Argument(help="Mesh file (OBJ, PLY, STL, ...).")],
    out: Annotated[Path, typer.Option(help="File to write, .npz.")],
    scale: Annotated[float, typer.Option(help="Metres per unit of the mesh; 0.001 for mm.")] = 1.0,
    resolution: Annotated[int, typer.Option(min=2, help="Nodes a side.")] = 128,
) -> None:
    """Build the signed distance field of a mesh; `GridSdf.load` reads the file."""
    from ..meshes import read_mesh
    from ..sdf.build import build_sdf

    surface = read_mesh(mesh)
    surface.apply_scale(scale)
    grid = build_sdf(surface, resolution=resolution)
    grid.save(out)
    side = " x ".join(str(count) for count in grid.values.shape)
    spacing_mm = float(grid.spacing.max()) * 1e3
    typer.echo(f"{out}: {side} nodes, {spacing_mm:.2f} mm apart")
