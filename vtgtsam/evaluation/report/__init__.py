# SPDX-License-Identifier: MIT
"""``figures/`` and ``report.html``: one page that can be read, printed and sent, and needs no network.

``words`` says in sentences what the numbers mean, ``content`` makes the tables, ``template.html`` the page.
"""

from __future__ import annotations

from importlib.util import find_spec
from pathlib import Path

from ..tables import Tables

_NEEDED = ("matplotlib", "jinja2")


def missing_packages() -> str:
    """What to install before a report can be made, in one sentence; empty if nothing is missing."""
    missing = [name for name in _NEEDED if find_spec(name) is None]
    if not missing:
        return ""
    return (
        f"figures and report.html need {' and '.join(missing)}: pip install 'vtgtsam[report]', "
        "then `vtgtsam report` makes them from what is stored"
    )


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
