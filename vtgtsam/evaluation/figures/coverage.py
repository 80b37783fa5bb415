# SPDX-License-Identifier: MIT
"""How often a pose's uncertainty holds the truth, and how often it promises to."""

from __future__ import annotations

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..consistency import LEVELS
from ..groups import Group, phase_name, phase_words
from ..phases import AFTER, BEFORE
from ..statistics import ALL, IN_REGION
from .drawing import Drawing
from .style import COLUMN, Look, looks


def coverage_figure(group: Group) -> Drawing | None:
    """Share of frames whose regions hold the truth over the regions' probability; None without covariances."""
    statistics = group.rows(group.tables.collected.phases)
    phases = [BEFORE, AFTER] if group.phase == AFTER else [ALL]
    shares = {phase: _shares(statistics[statistics["phase"] == phase]) for phase in phases}
    if not any(shares.values()):
        return None
    figure = Figure(figsize=(COLUMN, 2.9))
    look = looks(group.methods)
    axes = np.atleast_1d(figure.subplots(1, len(phases), sharey=True))
    for ax, phase in zip(axes, phases, strict=True):
        _draw(ax, shares[phase], look, phase_name(phase))
    axes[0].set_ylabel("frames inside [%]")
    handles, labels = axes[-1].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside lower center", ncols=3)
    return Drawing(f"{group.slug}_coverage", _caption(), _alt(shares), figure)


def _shares(statistics: pd.DataFrame) -> dict[str, list[float]]:
    """Of each method the shares of frames in the regions of ``LEVELS`` [%]; those without covariances are left out."""
    found = {}
    for method, rows in statistics.groupby("method", sort=False):
        frames = rows["frames_with_covariance"].sum()
        if frames:
            found[str(method)] = [1e2 * rows[name].sum() / frames for name in IN_REGION.values()]
    return found


def _draw(ax: Axes, shares: dict[str, list[float]], look: dict[str, Look], title: str) -> None:
    promised = [1e2 * level for level in LEVELS]
    ax.plot([0, 100], [0, 100], color="0.6", linewidth=0.8, label="as promised")
    for method, values in shares.items():
        drawn = look[method]
        ax.plot(
            promised,
            values,
            color=drawn.color,
            linestyle=drawn.line,
            marker=drawn.marker,
            markersize=3,
            label=method,
        )
    ax.set(xlim=(40, 100), ylim=(0, 100), title=title)
    ax.set_xticks(promised)
    ax.set_xlabel("region [%]")


def _caption() -> str:
    return (
        "Share of frames whose region holds the truth, over the probability with which it should, by each pose's "
        "covariance; symmetries of the object count. On the line the covariance is right, below it promises too much, "
        "above it is too careful."
    )


def _alt(shares: dict[str, dict[str, list[float]]]) -> str:
    parts = [
        f"{phase_words(phase)}: "
        + ", ".join(f"{method} {values[-1]:.0f} %" for method, values in found.items())
        for phase, found in shares.items()
        if found
    ]
    return f"Frames inside the {LEVELS[-1]:.0%} region: " + "; ".join(parts) + "."
