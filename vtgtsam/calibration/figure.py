# SPDX-License-Identifier: MIT
"""A calibration as a picture: each offset with what is known of it now and what was before."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..atomic import replacing
from ..extras import require
from .calibrate import Calibrated
from .printing import expectation, names_and_units

if TYPE_CHECKING:
    from matplotlib.axes import Axes

BEFORE, NOW = "#c9c9c9", "#1f6f8b"


def draw(result: Calibrated, path: Path) -> None:
    """Write the picture, a PNG file."""
    require("evaluate", "the picture of a calibration needs", "matplotlib")
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    units = names_and_units(result)
    turns = [i for i, (_, unit, _) in enumerate(units) if unit == "deg"]
    shifts = [i for i, (_, unit, _) in enumerate(units) if unit == "mm"]
    figure = Figure(figsize=(9, 2.2 + 0.27 * len(units)), layout="constrained")
    FigureCanvasAgg(figure)
    upper, lower = figure.subplots(
        2, 1, gridspec_kw={"height_ratios": [len(shifts) + 1, len(turns) + 1]}
    )
    _bars(upper, result, shifts, "mm")
    _bars(lower, result, turns, "degrees")
    upper.set_title(f"{len(result.used)} grasps of {result.calibration.hand}", loc="left")
    upper.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, frameon=False)
    figure.supxlabel(expectation(result), fontsize=9)
    with replacing(path) as temporary:
        figure.savefig(temporary, format="png", dpi=110)


def _bars(axes: Axes, result: Calibrated, chosen: list[int], unit: str) -> None:
    units = names_and_units(result)
    scales = np.array([units[i][2] for i in chosen])
    values = scales * result.calibration.offsets[chosen]
    now = scales * np.sqrt(np.diag(result.calibration.covariance))[chosen]
    before = scales * result.before[chosen]
    rows = np.arange(len(chosen))
    axes.barh(
        rows, 2 * before, left=-before, color=BEFORE, height=0.7, label="believed before, 1 sigma"
    )
    axes.errorbar(values, rows, xerr=now, fmt="o", color=NOW, capsize=3, label="found, 1 sigma")
    axes.axvline(0.0, color="black", linewidth=0.6)
    axes.set_yticks(rows, [units[i][0] for i in chosen])
    axes.set_xlabel(unit)
    axes.invert_yaxis()
    axes.spines[["top", "right"]].set_visible(False)
