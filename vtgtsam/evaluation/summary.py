# SPDX-License-Identifier: MIT
"""``summary.csv``: how well each method does on each object and on all of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from .statistics import ALL, quantile

CONDITION = (
    "dataset",
    "tracker",
    "noise_scale",
)  # recordings that differ in these are never pooled

COLUMNS = (
    *CONDITION,
    "object",
    "method",
    "phase",
    "sequences",
    "frames",
    "frames_without_pose",
    "frames_not_held",
    "share_below_5mm",
    "adds_median_mm",
    "adds_q25_mm",
    "adds_q75_mm",
    "add_median_mm",
    "translation_median_mm",
    "rotation_median_deg",
)


def summarise(statistics: pd.DataFrame) -> pd.DataFrame:
    """One row for each condition, object (or "all"), method and phase.

    Medians and quartiles are taken over the sequences' medians, so that each sequence counts the same;
    ``share_below_5mm`` is the share of frames.
    """
    pooled = statistics.assign(object=ALL)
    rows = []
    for table in (pooled, statistics):
        for key, group in table.groupby([*CONDITION, "object", "method", "phase"], sort=False):
            rows.append(dict(zip(COLUMNS, key, strict=False)) | _summary(group))
    summary = pd.DataFrame(rows, columns=list(COLUMNS))
    return _in_order(summary, list(dict.fromkeys(statistics["method"])))


def _summary(sequences: pd.DataFrame) -> dict[str, Any]:
    adds = sequences["adds_median_m"].to_numpy() * 1e3
    frames = int(sequences["frames"].sum())
    return {
        "sequences": len(sequences),
        "frames": frames,
        "frames_without_pose": int(sequences["frames_without_pose"].sum()),
        "frames_not_held": int(sequences["frames_not_held"].sum()),
        "share_below_5mm": int(sequences["frames_below_5mm"].sum()) / frames,
        "adds_median_mm": quantile(adds, 0.5),
        "adds_q25_mm": quantile(adds, 0.25),
        "adds_q75_mm": quantile(adds, 0.75),
        "add_median_mm": quantile(sequences["add_median_m"].to_numpy() * 1e3, 0.5),
        "translation_median_mm": quantile(sequences["translation_median_m"].to_numpy() * 1e3, 0.5),
        "rotation_median_deg": np.degrees(
            quantile(sequences["rotation_median_rad"].to_numpy(), 0.5)
        ),
    }


def _in_order(summary: pd.DataFrame, methods: list[str]) -> pd.DataFrame:
    """Sorted by condition and object, "all" first; methods as they were given, phases as they come."""
    order = summary.assign(
        pooled=summary["object"] != ALL,
        nth_method=summary["method"].map(methods.index),
        nth_phase=summary["phase"].map([ALL, "before", "after"].index),
    )
    by = [*CONDITION, "pooled", "object", "nth_method", "nth_phase"]
    return summary.loc[order.sort_values(by, kind="stable").index].reset_index(drop=True)
