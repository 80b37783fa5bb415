# SPDX-License-Identifier: MIT
"""``vtgtsam check-mesh``: whether a mesh is fit to be tracked."""

from __future__ import annotations

import typer

from .options import Mesh, Resolution, Scale

PROBLEMS = 1


def check_mesh(mesh: Mesh, scale: Scale = 1.0, resolution: Resolution = 128) -> None:
    """Look a mesh over: units, holes, thin walls, distance field. Exit code 1 if it has problems."""
    from ..mesh.check import check_mesh as check

    report = check(mesh, scale=scale, resolution=resolution)
    typer.echo(str(report))
    if report.problems:
        raise typer.Exit(PROBLEMS)
