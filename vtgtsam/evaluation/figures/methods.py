# SPDX-License-Identifier: MIT
"""Box plots over methods, before and after the hand's turn: the paper's ADD-S statistics."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from ..groups import Group, phase_name, phase_words
from ..phases import AFTER, BEFORE
from ..statistics import ALL, quantile
from ..units import samples, unit_of
from .boxes import boxes_caption, grouped_boxes, method_handles
from .drawing import Drawing
from .marks import STARS_CAPTION, comparisons, star_rows, stars, with_marks
from .style import COLUMN, looks


def methods_figure(group: Group) -> Drawing:
    """ADD-S of each method; a sample is a sequence's median, or the mean of an object's runs."""
    statistics = group.rows(group.tables.collected.phases)
    phases = [BEFORE, AFTER] if group.phase == AFTER else [ALL]
    tables = [1e3 * samples(statistics[statistics["phase"] == phase]) for phase in phases]
    labels = [
        f"{phase_name(phase)}\n({_counted(len(table), group.dataset)})"
        for phase, table in zip(phases, tables, strict=True)
    ]
    look = looks(group.methods)
    rows = comparisons(group.rows(group.tables.tests), group.methods)
    figure = Figure(figsize=(COLUMN, 3.3))
    above, ax = with_marks(figure, len(rows))
    grouped_boxes(ax, tables, labels, look)
    star_rows(above, [(label, _texts(tests, phases)) for label, tests in rows])
    figure.legend(handles=method_handles(look), loc="outside lower center", ncols=3)
    return Drawing(
        f"{group.slug}_methods",
        _caption(group, boxes_caption(tables), bool(rows)),
        _alt(tables, phases),
        figure,
    )


def _texts(tests: pd.DataFrame, phases: list[str]) -> list[str]:
    by_phase = {test["phase"]: test for test in tests.to_dict("records")}
    return [stars(by_phase[phase]) if phase in by_phase else "" for phase in phases]


def _counted(count: int, dataset: str) -> str:
    unit = unit_of(dataset)
    return f"{count} {unit}" if count == 1 else f"{count} {unit}s"


def _caption(group: Group, boxes: str, marked: bool) -> str:
    unit = (
        "the mean of an object's runs, each with its median"
        if unit_of(group.dataset) == "object"
        else "the median of one sequence"
    )
    marks = " " + STARS_CAPTION.format(ours=group.methods[-1]) if marked else ""
    return f"ADD-S of the methods. A sample is {unit}. {boxes}{marks}"


def _alt(tables: list[pd.DataFrame], phases: list[str]) -> str:
    parts = [
        f"{phase_words(phase)}: "
        + ", ".join(f"{name} {quantile(table[name].to_numpy(), 0.5):.2f} mm" for name in table)
        for phase, table in zip(phases, tables, strict=True)
    ]
    return "Box plots of ADD-S. Medians " + "; ".join(parts) + "."
