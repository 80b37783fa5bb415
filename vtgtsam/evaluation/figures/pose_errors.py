# SPDX-License-Identifier: MIT
"""Position and rotation of the pose beside its ADD-S: box plots over methods."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from ..groups import Group, phase_words
from ..statistics import quantile
from ..units import samples, unit_of
from .boxes import boxes_caption, grouped_boxes, method_handles
from .drawing import Drawing
from .style import WIDE, looks

_PANELS = (  # column, factor to the unit, unit, what it is
    ("translation_median_m", 1e3, "mm", "position"),
    ("rotation_median_rad", float(np.degrees(1.0)), "°", "rotation"),
)


def pose_errors_figure(group: Group) -> Drawing:
    """Errors of the object's centre [mm] and of its orientation [deg], in the phase that counts most."""
    statistics = group.rows(group.tables.collected.phases)
    statistics = statistics[statistics["phase"] == group.phase]
    look = looks(group.methods)
    figure = Figure(figsize=(WIDE, 2.6))
    tables = []
    for ax, (column, factor, unit, name) in zip(figure.subplots(1, 2), _PANELS, strict=True):
        tables.append(factor * samples(statistics, column))
        grouped_boxes(ax, tables[-1:], [""], look, f"{name} [{unit}]")
    figure.legend(handles=method_handles(look), loc="outside lower center", ncols=4)
    return Drawing(
        f"{group.slug}_pose_errors", _caption(group, boxes_caption(tables)), _alt(tables), figure
    )


def _caption(group: Group, boxes: str) -> str:
    unit = (
        "the mean of an object's runs"
        if unit_of(group.dataset) == "object"
        else "the median of one sequence"
    )
    return (
        f"Position of the object's centre and rotation, smallest over its symmetries, {phase_words(group.phase)}. "
        f"A sample is {unit}. {boxes}"
    )


def _alt(tables: list[pd.DataFrame]) -> str:
    parts = [
        f"{name}: "
        + ", ".join(f"{m} {quantile(table[m].to_numpy(), 0.5):.2f} {unit}" for m in table)
        for table, (_, _, unit, name) in zip(tables, _PANELS, strict=True)
    ]
    return "Box plots of the pose's errors. Medians of " + "; ".join(parts) + "."
