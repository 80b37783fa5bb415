# SPDX-License-Identifier: MIT
"""Box plots over noise scales."""

from __future__ import annotations

import pandas as pd
from matplotlib.figure import Figure

from ..groups import Group, phase_words
from ..phases import AFTER, BEFORE
from ..statistics import quantile
from ..units import samples
from .boxes import boxes_caption, grouped_boxes, method_handles
from .drawing import Drawing
from .marks import STARS_CAPTION, comparisons, star_rows, stars, with_marks
from .style import COLUMN, looks


def noise_figure(group: Group, phase: str) -> Drawing:
    """ADD-S of each method at each noise scale, before or after the turn."""
    statistics = group.at_all_scales(group.tables.collected.phases)
    statistics = statistics[statistics["phase"] == phase]
    tables = [
        1e3 * samples(statistics[statistics["noise_scale"] == scale]) for scale in group.scales
    ]
    look = looks(group.methods)
    tests = group.at_all_scales(group.tables.tests_noise)
    rows = comparisons(tests[tests["phase"] == phase], group.methods)
    figure = Figure(figsize=(COLUMN, 3.3))
    above, ax = with_marks(figure, len(rows))
    grouped_boxes(ax, tables, list(group.scales), look)
    ax.set_xlabel(f"noise scale, {phase_words(phase)}")
    star_rows(above, [(label, _texts(found, group.scales)) for label, found in rows])
    figure.legend(handles=method_handles(look), loc="outside lower center", ncols=3)
    return Drawing(
        f"{group.slug}_noise_{phase}",
        _caption(group, phase, boxes_caption(tables), bool(rows)),
        _alt(tables, group, phase),
        figure,
    )


def noise_phases(group: Group) -> list[str]:
    """The phases worth a figure over noise scales; none where there is only one scale."""
    if len(group.scales) < 2:
        return []
    return [BEFORE, AFTER] if group.phase == AFTER else [BEFORE]


def _texts(tests: pd.DataFrame, scales: tuple[str, ...]) -> list[str]:
    by_scale = {test["noise_scale"]: test for test in tests.to_dict("records")}
    return [stars(by_scale[scale]) if scale in by_scale else "" for scale in scales]


def _caption(group: Group, phase: str, boxes: str, marked: bool) -> str:
    words = f"ADD-S {phase_words(phase)} at each scale of the images' noise. {boxes}"
    marks = " " + STARS_CAPTION.format(ours=group.methods[-1]) if marked else ""
    return words + marks + " Holm's correction spans all scales."


def _alt(tables: list[pd.DataFrame], group: Group, phase: str) -> str:
    parts = [
        f"scale {scale}: "
        + ", ".join(f"{name} {quantile(table[name].to_numpy(), 0.5):.2f} mm" for name in table)
        for scale, table in zip(group.scales, tables, strict=True)
        if len(table)
    ]
    return f"Box plots of ADD-S {phase_words(phase)}. Medians at " + "; ".join(parts) + "."
