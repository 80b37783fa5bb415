# SPDX-License-Identifier: MIT
"""``figures/`` and ``report.html``: one page that can be read, printed and sent, and needs no network.

``words`` says in sentences what the numbers mean, ``content`` makes the tables, ``template.html`` the page.
"""

from __future__ import annotations

from pathlib import Path

from ...exceptions import MissingExtraError
from ...extras import require
from ..tables import Tables


def missing_packages() -> str:
    """What to install before a report can be made, in one sentence; empty if nothing is missing."""
    try:
        require("evaluate", "figures and report.html need", "matplotlib", "jinja2")
    except MissingExtraError as error:
        return f"{error}, then `vtgtsam report` makes them from what is stored"
    return ""


def make_report(out: Path, tables: Tables) -> Path:
    """Draw all figures and write the page anew.

    Args:
        out: The run's folder.
        tables: Its tables, as ``make_tables`` gives them.

    Returns:
        The page.
    """
    from ...atomic import write_text
    from .. import folder
    from ..figures import make_figures
    from ..store import REPORT
    from .page import render

    folder.check(out, [REPORT])
    chapters = make_figures(out, tables)
    folder.claim(out, [REPORT])
    write_text(out / REPORT, render(out, tables, chapters))
    folder.settle(out)
    return out / REPORT
