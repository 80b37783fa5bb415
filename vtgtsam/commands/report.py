# SPDX-License-Identifier: MIT
"""``vtgtsam report``: the tables of an evaluation again."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def report(
    folder: Annotated[Path, typer.Argument(help="Folder that `vtgtsam evaluate` wrote.")],
) -> None:
    """Make the tables again from what an evaluation stored, without estimating anything."""
    from ..evaluation.printing import tables_text
    from ..evaluation.tables import make_tables

    typer.echo(tables_text(make_tables(folder)))
    typer.echo(f"\nAll results are in {folder}")
