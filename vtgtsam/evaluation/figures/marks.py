# SPDX-License-Identifier: MIT
"""What the paired tests say, above the axes they belong to: a line of marks for each comparison."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..significance import FEWEST
from .style import GREY

SIGNIFICANT = 0.05
_STARS = ((1e-4, "****"), (1e-3, "***"), (1e-2, "**"), (SIGNIFICANT, "*"))

STARS_CAPTION = (
    "Above, {ours} against the others: * p < 0.05, ** p < 0.01, *** p < 0.001, **** p < 0.0001 "
    "(Wilcoxon's test after Holm's correction), in brackets where {ours} is the worse one; "
    "n.s.: no significant difference; –: too few pairs to tell."
)


def comparisons(tests: pd.DataFrame, methods: Sequence[str]) -> list[tuple[str, pd.DataFrame]]:
    """The last method's tests against each of the others: their names and the rows.

    None where there are too few pairs for any test to show anything.
    """
    ours = methods[-1]
    if not (tests["n"] >= FEWEST).any():
        return []
    named = [(other, f"{ours} vs {other}") for other in methods[:-1]]
    return [(f"vs {other}", tests[tests["comparison"] == name]) for other, name in named]


def with_marks(figure: Figure, rows: int) -> tuple[Axes, Axes]:
    """Axes for the marks of that many comparisons, and below them the axes for the data."""
    above, ax = figure.subplots(2, 1, sharex=True, height_ratios=[0.2 * max(rows, 0.1), 2.4])
    return above, ax


def stars(test: Mapping[Any, Any]) -> str:
    """One test as text."""
    p = test["p_holm"]
    if pd.isna(p) or "too few" in str(test["note"]):
        return "–"
    found = next((text for limit, text in _STARS if p < limit), "")
    if not found:
        return "n.s."
    return found if test["effect_size"] > 0 else f"({found})"


def star_rows(ax: Axes, rows: Sequence[tuple[str, Sequence[str]]]) -> None:
    """Texts above each group of boxes at x = 0, 1, ...; the last row lies lowest."""
    ax.set_ylim(-0.6, len(rows) - 0.4)
    for y, (label, texts) in enumerate(reversed(rows)):
        for x, text in enumerate(texts):
            ax.text(x, y, text, ha="center", va="center", fontsize=8.5)
        ax.axhline(y - 0.5, color="#dddddd", lw=0.6)
        ax.text(
            -0.01,
            y,
            label,
            transform=ax.get_yaxis_transform(),
            ha="right",
            va="center",
            fontsize=7.5,
            color=GREY,
        )
    _bare(ax)


def step_rows(ax: Axes, rows: Sequence[tuple[str, pd.DataFrame]], color: str) -> None:
    """Filled squares over the time steps in which our method is better, crosses where it is worse."""
    ax.set_ylim(-0.6, len(rows) - 0.4)
    for y, (label, tests) in enumerate(reversed(rows)):
        found = tests[tests["p_holm"] < SIGNIFICANT]
        middle = (found["time_start_s"] + found["time_end_s"]) / 2
        better = found["effect_size"] > 0
        ax.plot(middle[better], [y] * int(better.sum()), "s", ms=4.2, color=color, ls="")
        ax.plot(middle[~better], [y] * int((~better).sum()), "x", ms=4.2, color="black", ls="")
        if found.empty:
            ax.text(
                0.5,
                y,
                "no step significant",
                transform=ax.get_yaxis_transform(),
                ha="center",
                va="center",
                fontsize=7.5,
                color=GREY,
            )
        ax.text(
            -0.01,
            y,
            label,
            transform=ax.get_yaxis_transform(),
            ha="right",
            va="center",
            fontsize=7.5,
            color=GREY,
        )
    _bare(ax)


def _bare(ax: Axes) -> None:
    ax.grid(False)
    ax.spines[:].set_visible(False)
    ax.tick_params(left=False, bottom=False, labelleft=False, labelbottom=False)
