# SPDX-License-Identifier: MIT
"""How all figures look: readable in print, in grey and by the colour-blind.

A method has its colour (``palette``), line style, hatch and marker in every figure, so that
none of them depends on colour alone. A figure is as wide as a paper's column and its text as large as a
caption's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullLocator

from ..palette import OF_METHODS, OTHERS
from ..statistics import quantile

COLUMN = 4.2  # [inch], width of a figure; 17 % wider than a paper's column, shown at its width
WIDE = 2 * COLUMN

STYLE: dict[str, Any] = {
    "font.size": 9.0,
    "axes.titlesize": 9.0,
    "axes.labelsize": 9.0,
    "xtick.labelsize": 8.5,
    "ytick.labelsize": 8.5,
    "legend.fontsize": 8.5,
    "legend.frameon": False,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.8,
    "axes.grid": True,
    "axes.axisbelow": True,
    "grid.color": "#dddddd",
    "grid.linewidth": 0.6,
    "hatch.linewidth": 0.6,
    "lines.linewidth": 1.6,
    "figure.constrained_layout.use": True,
    "svg.hashsalt": "vtgtsam",  # the same picture has the same bytes
    "svg.fonttype": "path",  # and looks the same without the font
}

GREY = "#595959"

_WIDE_SPREAD = 12.0  # largest over small values, from which on a logarithmic axis shows more
_STEPS = (1, 2, 2.5, 5, 10)  # between the ticks of an axis
_SMALLEST = 0.01  # [mm], smaller errors are drawn here


@dataclass(frozen=True)
class Look:
    """What a method is drawn with."""

    color: str
    line: Any
    hatch: str
    marker: str


_KNOWN = {
    "vis": Look(OF_METHODS["vis"], (0, (4, 1.5)), "", "o"),
    "vis+pen": Look(OF_METHODS["vis+pen"], (0, (6, 1.5, 1, 1.5)), "////", "s"),
    "vis+tac+pen": Look(OF_METHODS["vis+tac+pen"], "-", "xxxx", "D"),
    "vis+tac+pen+mem": Look(OF_METHODS["vis+tac+pen+mem"], (0, (3, 1, 1, 1, 1, 1)), "||||", "P"),
}
_OTHERS = (
    Look(OTHERS[0], (0, (1, 1)), "\\\\\\\\", "^"),
    Look(OTHERS[1], (0, (8, 2)), "++++", "v"),
    Look(OTHERS[2], (0, (1, 3)), "----", "X"),
)


def looks(methods: Sequence[str]) -> dict[str, Look]:
    """Each method's look; the paper's methods look the same in every run."""
    others = [name for name in methods if name not in _KNOWN]
    free = {name: _OTHERS[i % len(_OTHERS)] for i, name in enumerate(others)}
    return {name: _KNOWN.get(name) or free[name] for name in methods}


def error_axis(ax: Axes, which: str, values_mm: np.ndarray, label: str = "ADD-S [mm]") -> None:
    """Scale an axis to errors: from 0, or logarithmic where they are of very different size.

    Args:
        ax: The axes.
        which: "x" or "y".
        values_mm: What is drawn along it [mm]; infinite ones have no place.
        label: What it shows, with its unit.
    """
    values = np.asarray(values_mm, dtype=float).ravel()
    values = values[np.isfinite(values)]
    axis = ax.xaxis if which == "x" else ax.yaxis
    set_limits = ax.set_xlim if which == "x" else ax.set_ylim
    axis.set_label_text(label)
    if len(values) == 0:
        set_limits(0.0, 1.0)
        return
    small, largest = max(quantile(values, 0.05), _SMALLEST), max(float(values.max()), _SMALLEST)
    if largest / small <= _WIDE_SPREAD:
        set_limits(0.0, 1.06 * largest)
        axis.set_major_locator(MaxNLocator(6, steps=_STEPS))
        return
    lowest = max(float(values.min()), _SMALLEST)
    (ax.set_xscale if which == "x" else ax.set_yscale)("log")
    set_limits(lowest / 1.2, largest * 1.25)
    decades = np.log10(largest / lowest)
    axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if decades < 2.5 else (1.0,)))
    axis.set_minor_locator(NullLocator())
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
