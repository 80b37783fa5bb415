# SPDX-License-Identifier: MIT
"""Puts words, figures and tables into the page."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import jinja2

from ..figures import Chapter
from ..figures.drawing import Picture
from ..figures.style import looks
from ..groups import Group, phase_words
from ..phases import AFTER
from ..statistics import ALL, IN_REGION
from ..tables import Tables
from .content import page_tables
from .made import how_made
from .words import at_other_scales, counted, degrees, millimetres, number, scope, verdict

_HERE = Path(__file__).parent


@dataclass(frozen=True)
class _Tile:
    """One method's result in a glance."""

    method: str
    color: str
    median: str
    interval: str
    position: str
    rotation: str
    below_5mm: str
    covered: str


def render(out: Path, tables: Tables, chapters: Sequence[Chapter]) -> str:
    """The page's HTML.

    Args:
        out: The run's folder.
        tables: Its tables.
        chapters: Its figures.
    """
    environment = jinja2.Environment(
        loader=jinja2.FileSystemLoader(_HERE),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        keep_trailing_newline=True,
    )
    environment.filters["data_url"] = _data_url
    template = environment.get_template("template.html")
    return template.render(
        style=(_HERE / "style.css").read_text(encoding="utf-8"),
        script=(_HERE / "tables.js").read_text(encoding="utf-8"),
        lead=_lead(tables),
        chapters=[_chapter(chapter) for chapter in chapters],
        turns=any(chapter.group.phase == AFTER for chapter in chapters),
        failed=tables.failed,
        notes=_notes(tables),
        tables=page_tables(tables),
        made=how_made(out),
    )


def _lead(tables: Tables) -> str:
    done = tables.sequences[tables.sequences["problem"] == ""]
    methods = tables.collected.methods
    words = f"{counted(len(done), 'sequence')} of {counted(done['object'].nunique(), 'object')}"
    if not methods:
        return f"{words} estimated; there is no truth to compare with, so there are no errors."
    return f"{counted(len(methods), 'method')} on {words}: {', '.join(methods)}."


def _chapter(chapter: Chapter) -> dict[str, Any]:
    group = chapter.group
    single = len(group.rows(group.tables.collected.turns)) == 1
    worst = "Frame by frame" if single else "The worst sequences, frame by frame"
    return {
        "slug": group.slug,
        "title": group.title,
        "scope": scope(group),
        "phase": phase_words(group.phase),
        "tiles": _tiles(group),
        "verdicts": [*verdict(group), *filter(None, [at_other_scales(group)])],
        "scale": group.scale if len(group.scales) > 1 else "",
        "overview": chapter.overview,
        "worst": (worst, chapter.worst),
    }


def _tiles(group: Group) -> list[_Tile]:
    summary = group.rows(group.tables.summary)
    rows = summary[(summary["object"] == ALL) & (summary["phase"] == group.phase)]
    look = looks(group.methods)
    return [
        _Tile(
            row["method"],
            look[row["method"]].color,
            millimetres(row["adds_median_mm"]),
            _interval(row["adds_median_low_mm"], row["adds_median_high_mm"]),
            millimetres(row["translation_median_mm"]),
            degrees(row["rotation_median_deg"]),
            _share(row["share_below_5mm"]),
            _share(row[f"share_{IN_REGION[0.95].removeprefix('frames_')}"]),
        )
        for row in rows.to_dict("records")
    ]


def _share(share: float) -> str:
    return "–" if share != share else f"{100 * share:.0f}\N{NO-BREAK SPACE}%"


def _interval(low: float, high: float) -> str:
    return "" if low != low else f"95 % interval {number(low)} to {number(high)} mm"


def _notes(tables: Tables) -> dict[str, int]:
    """What is missing in some sequences, and in how many."""
    notes = [*tables.sequences["note"], *tables.sequences["warnings"]]
    return {note: notes.count(note) for note in dict.fromkeys(notes) if note}


def _data_url(picture: Picture) -> str:
    return "data:image/svg+xml;base64," + base64.b64encode(picture.svg.encode()).decode()
