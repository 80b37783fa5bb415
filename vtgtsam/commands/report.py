# SPDX-License-Identifier: MIT
"""``vtgtsam report``: tables, tests, figures and the page of an evaluation again."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from ..evaluation.tables import Tables


def report(
    folder: Annotated[Path, typer.Argument(help="Folder that `vtgtsam evaluate` wrote.")],
) -> None:
    """Make tables, figures and report.html again from what is stored, without estimating anything."""
    from ..extras import require

    require("evaluate", "a report needs", "pandas", "pyarrow")
    from ..evaluation.folder import in_use
    from ..evaluation.printing import tables_text
    from ..evaluation.tables import check_finished, make_tables

    check_finished(folder)
    with in_use(folder, force=True):  # of an older version as well
        tables = make_tables(folder)
        typer.echo(tables_text(tables))
        write_report(folder, tables)


def write_report(folder: Path, tables: Tables) -> None:
    """Make figures and page where the packages for it are installed, and say where everything is."""
    from ..evaluation.report import make_report, missing_packages

    missing = missing_packages()
    if missing:
        typer.echo(f"vtgtsam: {missing}", err=True)
    else:
        typer.echo(f"\nTo look at in a browser: {make_report(folder, tables)}")
    typer.echo(f"\nAll results are in {folder}")
