# SPDX-License-Identifier: MIT
"""Median and quartiles over time, with the steps in which the difference is significant."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from ..groups import Group
from ..statistics import ALL
from ..steps import STEP
from .drawing import Drawing
from .marks import comparisons, step_rows, with_marks
from .style import COLUMN, GREY, Look, error_axis, looks


def time_figure(group: Group) -> Drawing:
    """ADD-S of each method over the sequences' time."""
    curves = well_filled(_of_all(group))
    look = looks(group.methods)
    rows = comparisons(group.rows(group.tables.tests_time), group.methods)
    figure = Figure(figsize=(COLUMN, 3.3))
    above, ax = with_marks(figure, len(rows))
    draw_curves(ax, curves, look)
    shade_turn(ax, group)
    end = curves["time_end_s"].max()
    step_rows(
        above,
        [(label, t[t["time_end_s"] <= end]) for label, t in rows],
        look[group.methods[-1]].color,
    )
    ax.set_xlabel("time since the first frame [s]")
    figure.legend(handles=line_handles(look), loc="outside lower center", ncols=3)
    return Drawing(f"{group.slug}_time", _caption(group, bool(rows)), _alt(curves), figure)


def draw_curves(
    ax: Axes,
    curves: pd.DataFrame,
    look: dict[str, Look],
    band: bool = True,
    scaled: bool = True,
) -> None:
    """Medians as lines and quartiles as bands [mm], from rows of ``over_time.csv``.

    ``scaled`` says whether the axis of errors is to be set to fit them.
    """
    names = ["adds_median_mm", "adds_q25_mm", "adds_q75_mm"] if band else ["adds_median_mm"]
    if scaled:
        error_axis(ax, "y", curves[names].to_numpy(dtype=float))
    for method, style in look.items():
        rows = curves[curves["method"] == method].sort_values("time_start_s")
        middle = (rows["time_start_s"] + rows["time_end_s"]) / 2
        # An infinite error, which is a frame without a pose, leaves a gap.
        low, median, high = (
            rows[name].replace(np.inf, np.nan)
            for name in ("adds_q25_mm", "adds_median_mm", "adds_q75_mm")
        )
        if band and (rows["samples"] > 1).any():
            ax.fill_between(middle, low, high, color=style.color, alpha=0.18, lw=0)
        ax.plot(middle, median, color=style.color, ls=style.line)
    ax.set_xlim(0, curves["time_end_s"].max())


def well_filled(curves: pd.DataFrame) -> pd.DataFrame:
    """The steps that at least half of the samples reach: what few sequences are left says little."""
    filled: pd.DataFrame = curves[curves["samples"] >= 0.5 * curves["samples"].max()]
    return filled


def shade_turn(ax: Axes, group: Group, label: bool = True) -> None:
    """Shade the time in which the hand turns: from the median beginning to the median end."""
    turns = group.rows(group.tables.collected.turns)[["turn_start", "turn_end"]].dropna()
    if turns.empty:
        return
    start, end = turns.astype(float).median()
    ax.axvspan(start, end, color="#ececec", lw=0, zorder=0)
    if label:
        ax.text(
            (start + end) / 2,
            0.98,
            "hand turns",
            transform=ax.get_xaxis_transform(),
            ha="center",
            va="top",
            fontsize=8,
            color=GREY,
        )


def line_handles(look: dict[str, Look]) -> list[Line2D]:
    """Entries of a legend."""
    return [
        Line2D([], [], color=style.color, ls=style.line, label=method)
        for method, style in look.items()
    ]


def _of_all(group: Group) -> pd.DataFrame:
    table = group.rows(group.tables.over_time)
    return table[table["object"] == ALL]


def _caption(group: Group, marked: bool) -> str:
    words = (
        f"ADD-S over time, in steps of {STEP} s: medians as lines, quartiles as bands. "
        "Shaded: the hand turns."
    )
    if not marked:
        return words
    return words + (
        f" Above: steps in which {group.methods[-1]} is significantly better (squares) or worse "
        "(crosses), p < 0.05, Wilcoxon's test after Holm's correction over the steps."
    )


def _alt(curves: pd.DataFrame) -> str:
    ends = []
    for method, rows in curves.groupby("method", sort=False):
        first, last = rows.iloc[0], rows.iloc[-1]
        ends.append(
            f"{method} from {first['adds_median_mm']:.2f} to {last['adds_median_mm']:.2f} mm"
        )
    return "Line plot of the median ADD-S over time: " + ", ".join(ends) + "."
