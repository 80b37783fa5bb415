# SPDX-License-Identifier: MIT
"""Each object by itself: its sequences as points, and its medians over time."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import MaxNLocator

from ..groups import Group, phase_words
from ..statistics import ALL, quantile
from .drawing import Drawing
from .over_time import draw_curves, line_handles, shade_turn, well_filled
from .style import COLUMN, WIDE, Look, error_axis, looks

MOST = 42  # objects in a figure; of more, those in which the last method is worst
COLUMNS = 4  # panels side by side


def objects_figure(group: Group) -> Drawing:
    """ADD-S of each object's sequences, worst object first."""
    rows = _of_phase(group)
    names = worst_objects(group)
    look = looks(group.methods)
    figure = Figure(figsize=(COLUMN, 1.1 + max(0.42 * len(names), 0.8)))
    ax = figure.subplots()
    error_axis(ax, "x", 1e3 * rows["adds_median_m"].to_numpy(dtype=float))
    for y, name in enumerate(names):
        _object(ax, y, rows[rows["object"] == name], look)
    ax.set_yticks(range(len(names)), [_short(name) for name in names])
    ax.set_ylim(len(names) - 0.5, -0.5)
    ax.set_xlabel(f"ADD-S {phase_words(group.phase)} [mm]")
    ax.grid(False, axis="y")
    for y in range(1, len(names)):
        ax.axhline(y - 0.5, color="#dddddd", lw=0.6, zorder=0)
    figure.legend(handles=_handles(look), loc="outside lower center", ncols=3)
    words = (
        f"Each object {phase_words(group.phase)}, worst first. Small marks are sequences, large ones "
        "their medians, lines reach from the best to the worst sequence."
    )
    return Drawing(f"{group.slug}_objects", words + _left_out(group, names), _alt(group), figure)


def panels_figure(group: Group) -> Drawing:
    """Median ADD-S over time, a panel an object."""
    names = worst_objects(group)
    table = group.rows(group.tables.over_time)
    look = looks(group.methods)
    columns = min(COLUMNS, len(names))
    lines = -(-len(names) // columns)
    figure = Figure(figsize=(WIDE if columns > 2 else COLUMN, 0.8 + 1.35 * lines))
    axes = figure.subplots(lines, columns, sharex=True, sharey=True, squeeze=False)
    shown = well_filled(table[table["object"].isin(names)])
    error_axis(axes.flat[0], "y", shown["adds_median_mm"].to_numpy(dtype=float), label="")
    for ax, name in zip(axes.flat, names, strict=False):
        draw_curves(ax, shown[shown["object"] == name], look, band=False, scaled=False)
        shade_turn(ax, group, label=False)
        ax.set_title(_short(name), loc="left", fontsize=8.5)
    for ax in axes.flat[len(names) :]:
        ax.set_visible(False)
        axes.flat[0].set_xlim(0, shown["time_end_s"].max())
    axes.flat[0].xaxis.set_major_locator(MaxNLocator(5, steps=(1, 2, 5, 10)))
    figure.supylabel("ADD-S [mm]", fontsize=9)
    figure.supxlabel("time since the first frame [s]", fontsize=9)
    figure.legend(handles=line_handles(look), loc="outside upper center", ncols=4)
    words = "Median ADD-S of each object's sequences over time. Shaded: the hand turns."
    return Drawing(
        f"{group.slug}_objects_time",
        words + _left_out(group, names),
        f"Line plots of the median ADD-S over time, one for each of {len(names)} objects.",
        figure,
    )


def worst_objects(group: Group) -> list[str]:
    """Names of the objects, the one in which the last method's median is largest first."""
    summary = group.rows(group.tables.summary)
    rows = summary[
        (summary["object"] != ALL)
        & (summary["phase"] == group.phase)
        & (summary["method"] == group.methods[-1])
    ]
    ordered = rows.sort_values(["adds_median_mm", "object"], ascending=[False, True])
    return [str(name) for name in ordered["object"].head(MOST)]


def _of_phase(group: Group) -> pd.DataFrame:
    rows = group.rows(group.tables.collected.phases)
    return rows[rows["phase"] == group.phase]


def _object(ax: Axes, y: float, rows: pd.DataFrame, look: dict[str, Look]) -> None:
    for place, (method, style) in zip(
        np.linspace(-0.26, 0.26, len(look)), look.items(), strict=True
    ):
        values = 1e3 * rows.loc[rows["method"] == method, "adds_median_m"].to_numpy(dtype=float)
        finite = values[np.isfinite(values)]
        if len(finite) == 0:
            continue
        line = np.full(len(finite), y + place)
        ax.plot(
            [finite.min(), finite.max()],
            line[:2] if len(line) > 1 else [line[0]] * 2,
            color=style.color,
            ls=style.line,
            lw=1.0,
        )
        if len(finite) > 1:
            ax.plot(finite, line, style.marker, ms=2.6, color=style.color, alpha=0.7, ls="")
        ax.plot(
            quantile(values, 0.5),
            y + place,
            style.marker,
            ms=5.5,
            color=style.color,
            mec="white",
            mew=0.5,
            ls="",
        )


def _handles(look: dict[str, Look]) -> list[Line2D]:
    return [
        Line2D([], [], color=s.color, ls=s.line, marker=s.marker, lw=1.0, ms=5, label=method)
        for method, s in look.items()
    ]


def _short(name: str) -> str:
    """An object's name that fits beside its panel."""
    words = name.replace("_", " ")
    return words if len(words) <= 22 else words[:21] + "…"


def _left_out(group: Group, names: list[str]) -> str:
    total = _of_phase(group)["object"].nunique()
    return f" Shown are the worst {len(names)} of {total} objects." if total > len(names) else ""


def _alt(group: Group) -> str:
    summary = group.rows(group.tables.summary)
    rows = summary[(summary["phase"] == group.phase) & (summary["method"] == group.methods[-1])]
    by_object = rows.set_index("object")["adds_median_mm"]
    parts = [f"{name} {by_object[name]:.2f} mm" for name in worst_objects(group)]
    return f"Dot plot of ADD-S by object. Medians of {group.methods[-1]}: " + ", ".join(parts) + "."
