# SPDX-License-Identifier: MIT
"""Box plots of several methods side by side, with every sample as a point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.patches import Patch

from ..palette import rgb
from ..statistics import quantile
from .style import Look, error_axis

WIDTH = 0.8  # of a group, where groups are 1 apart
FEWEST = 5  # samples for a box; fewer are shown as they are, with their median


def grouped_boxes(
    ax: Axes,
    groups: Sequence[pd.DataFrame],
    labels: Sequence[str],
    looks: Mapping[str, Look],
    quantity: str = "ADD-S [mm]",
) -> None:
    """Draw a group of boxes at x = 0, 1, ...: one box a method.

    Args:
        ax: Where to draw.
        groups: A row a sample, a column a method, in the quantity's unit.
        labels: Each group's name.
        looks: Each method's look, in the order of the boxes.
        quantity: What is drawn, with its unit.
    """
    values = [group.to_numpy(dtype=float).ravel() for group in groups]
    error_axis(ax, "y", np.concatenate(values), quantity)
    step = WIDTH / len(looks)
    for x, group in enumerate(groups):
        for i, (method, look) in enumerate(looks.items()):
            if method in group and len(group):
                place = x - WIDTH / 2 + (i + 0.5) * step
                _samples(ax, place, 0.86 * step, group[method].to_numpy(dtype=float), look)
    ax.set_xticks(range(len(groups)), labels)
    ax.set_xlim(-0.55, len(groups) - 0.45)
    ax.grid(False, axis="x")
    ax.tick_params(axis="x", length=0)


def boxes_caption(groups: Sequence[pd.DataFrame]) -> str:
    """How to read the boxes that are drawn."""
    if max((len(group) for group in groups), default=0) < FEWEST:
        return "Points are the samples, lines their medians."
    return (
        "Boxes show median and quartiles, whiskers reach to the last sample within 1.5 times the box, "
        "points are the samples"
        + (", ↑ counts those without a pose." if _infinite(groups) else ".")
    )


def _infinite(groups: Sequence[pd.DataFrame]) -> bool:
    return any(np.isinf(group.to_numpy(dtype=float)).any() for group in groups)


def method_handles(looks: Mapping[str, Look]) -> list[Patch]:
    """Entries of a legend."""
    return [
        Patch(facecolor=_light(look.color), edgecolor=look.color, hatch=look.hatch, label=method)
        for method, look in looks.items()
    ]


def _samples(ax: Axes, x: float, width: float, values: np.ndarray, look: Look) -> None:
    median = quantile(values, 0.5)
    if len(values) >= FEWEST:
        _box(ax, x, width, values, look)
    elif len(values) > 1 and np.isfinite(median):
        ax.plot([x - width / 2, x + width / 2], [median, median], color="black", lw=1.2, zorder=2)
    across = np.linspace(-0.32, 0.32, len(values)) if len(values) > 1 else np.zeros(1)
    ax.plot(
        x + width * across,
        values,
        look.marker,
        ms=_marker_size(len(values)),
        color=look.color,
        mec="white",
        mew=0.3,
        alpha=0.9,
        zorder=3,
        ls="",
    )
    without = int(np.isinf(values).sum())
    if without:
        where = ax.get_xaxis_transform()
        ax.text(x, 1.0, f"↑{without}", transform=where, ha="center", va="bottom", fontsize=7.5)


def _marker_size(count: int) -> float:
    """In points: the more samples, the smaller."""
    if count < FEWEST:
        return 6.0
    return 3.2 if count < 30 else 2.0


def _box(ax: Axes, x: float, width: float, values: np.ndarray, look: Look) -> None:
    top = ax.get_ylim()[1]
    finite = values[np.isfinite(values)]
    q1, median, q3 = (min(quantile(values, q), 2 * top) for q in (0.25, 0.5, 0.75))
    low, high = q1 - 1.5 * (q3 - q1), q3 + 1.5 * (q3 - q1)
    box = {
        "q1": q1,
        "med": median,
        "q3": q3,
        "whislo": min(q1, float(finite[finite >= low].min(initial=q1))),
        "whishi": max(q3, float(finite[finite <= high].max(initial=q3))),
    }
    ax.bxp(
        [box],
        positions=[x],
        widths=[width],
        showfliers=False,
        patch_artist=True,
        manage_ticks=False,
        boxprops={"facecolor": _light(look.color), "edgecolor": look.color, "hatch": look.hatch},
        medianprops={"color": "black", "lw": 1.6, "zorder": 4},
        whiskerprops={"color": look.color},
        capprops={"color": look.color},
    )


def _light(color: str) -> tuple[float, float, float]:
    """The colour on white paper with a third of its ink."""
    red, green, blue = (value / 255 for value in rgb(color))
    return 1 - 0.3 * (1 - red), 1 - 0.3 * (1 - green), 1 - 0.3 * (1 - blue)
