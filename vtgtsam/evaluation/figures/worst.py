# SPDX-License-Identifier: MIT
"""The sequences in which the last method is worst, frame by frame."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow.parquet as pq
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from .. import store
from ..contacts import read_contacts
from ..faults import read_faults
from ..groups import Group, phase_words
from ..statistics import NOT_HELD
from .contacts import contact_raster
from .drawing import Drawing
from .faults import fault_rows
from .over_time import line_handles
from .style import COLUMN, Look, error_axis, looks

COUNT = 6


def worst_sequences(group: Group) -> list[str]:
    """Ids of the sequences in which the last method's median ADD-S is largest, worst first."""
    rows = group.rows(group.tables.collected.phases)
    rows = rows[(rows["phase"] == group.phase) & (rows["method"] == group.methods[-1])]
    ordered = rows.sort_values(["adds_median_m", "sequence"], ascending=[False, True])
    return [str(name) for name in ordered["sequence"].head(COUNT)]


def worst_figure(group: Group, out: Path, sequence: str, place: int) -> Drawing:
    """ADD-S of all methods in one sequence, what was wrong with its streams, and the pads in contact below.

    Args:
        group: Of which the sequence is a part.
        out: The run's folder.
        sequence: Its id.
        place: 1 for the worst.
    """
    metrics = read_metrics(out, sequence)
    contacts = read_contacts(out, sequence)
    look = looks(group.methods)
    faults = read_faults(out, sequence, group.methods[-1])
    rows = [len(faults), 0 if contacts is None else len(contacts.pads)]
    figure = Figure(figsize=(COLUMN, 2.9 + 0.14 * sum(rows)))
    heights = [2.1, *(0.14 * count for count in rows if count)] if any(rows) else [1.0]
    axes = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[:, 0]
    _errors(axes[0], metrics, look)
    if faults:
        fault_rows(axes[1], faults)
    if contacts is not None:
        contact_raster(axes[-1], contacts)
    axes[-1].set_xlabel("time since the first frame [s]")
    axes[0].set_xlim(0, metrics["time_rel"].max() or 1.0)
    figure.legend(handles=line_handles(look), loc="outside lower center", ncols=3)
    return Drawing(
        f"{group.slug}_worst_{place}",
        f"{sequence}: {_medians(group, sequence)} {phase_words(group.phase)} (medians)."
        + (" Ticks at the bottom: nothing held the pose." if _lost(metrics).any() else "")
        + (f" Red ticks: what {group.methods[-1]} found wrong with the streams." if faults else ""),
        f"ADD-S over time and contacts of sequence {sequence}."
        + (f" Named: {', '.join(faults)}." if faults else ""),
        figure,
    )


def read_metrics(out: Path, sequence: str) -> pd.DataFrame:
    """One sequence's rows of ``metrics.parquet``."""
    filters = [("sequence", "==", sequence)]
    return pq.read_table(out / store.METRICS, filters=filters).to_pandas()  # type: ignore[no-any-return]


def _errors(ax: Axes, metrics: pd.DataFrame, look: dict[str, Look]) -> None:
    adds_mm = 1e3 * metrics["adds_m"].astype(float)
    error_axis(ax, "y", adds_mm.to_numpy())
    for i, (method, style) in enumerate(look.items()):
        rows = metrics["method"] == method
        times = metrics.loc[rows, "time_rel"]
        ax.plot(times, adds_mm[rows], color=style.color, ls=style.line, lw=1.2)
        lost = times[_lost(metrics)[rows]]
        height = np.full(len(lost), 0.02 + 0.035 * i)
        ax.plot(lost, height, "|", ms=4, color=style.color, transform=ax.get_xaxis_transform())
    turning = metrics.loc[metrics["phase"] == "turning", "time_rel"]
    if len(turning):
        ax.axvspan(turning.min(), turning.max(), color="#ececec", lw=0, zorder=0)


def _lost(metrics: pd.DataFrame) -> pd.Series:
    return metrics["status"].isin(NOT_HELD)


def _medians(group: Group, sequence: str) -> str:
    rows = group.rows(group.tables.collected.phases)
    rows = rows[(rows["sequence"] == sequence) & (rows["phase"] == group.phase)]
    return ", ".join(
        f"{method} {'no pose' if np.isinf(adds) else f'{1e3 * adds:.2f} mm'}"
        for method, adds in zip(rows["method"], rows["adds_median_m"], strict=True)
    )
