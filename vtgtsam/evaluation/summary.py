# SPDX-License-Identifier: MIT
"""``summary.csv`` and ``over_time.csv``: how well each method does on each object and on all of them."""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from .bootstrap import median_interval
from .collect import CONDITION
from .statistics import ALL, IN_REGION, PHASES, quantile
from .steps import STEP
from .units import samples_alone

COLUMNS = (
    *CONDITION,
    "object",
    "method",
    "phase",
    "sequences",
    "samples",
    "frames",
    "frames_without_pose",
    "frames_not_held",
    "share_below_5mm",
    "share_below_10mm",
    "auc_10cm",
    "adds_median_mm",
    "adds_median_low_mm",
    "adds_median_high_mm",
    "adds_q25_mm",
    "adds_q75_mm",
    "add_median_mm",
    "translation_median_mm",
    "rotation_median_deg",
    "nees",
    *(f"share_{name.removeprefix('frames_')}" for name in IN_REGION.values()),
)

TIME_COLUMNS = (
    *CONDITION,
    "object",
    "method",
    "time_start_s",
    "time_end_s",
    "samples",
    "adds_median_mm",
    "adds_q25_mm",
    "adds_q75_mm",
)


def summarise(statistics: pd.DataFrame) -> pd.DataFrame:
    """One row for each condition, object (or "all"), method and phase.

    Medians and quartiles are taken over the samples' values (``units``), so that each sequence counts the
    same; the 95 % interval of the median ADD-S is a bootstrap's, empty for fewer than six samples. Shares
    and the area under the curve are over frames.
    """
    rows = [
        key | _summary(group, pooled)
        for key, group, pooled in _groups(statistics, ["method", "phase"])
    ]
    summary = pd.DataFrame(rows, columns=list(COLUMNS))
    return _in_order(summary, _methods(statistics), "phase", list(PHASES))


def over_time(steps: pd.DataFrame) -> pd.DataFrame:
    """Median and quartiles over the samples for each condition, object (or "all"), method and time step."""
    rows = [
        key
        | {"time_start_s": key["step"] * STEP, "time_end_s": (key["step"] + 1) * STEP}
        | _quartiles(_sampled(group, "adds_median_m", pooled))
        for key, group, pooled in _groups(steps, ["method", "step"])
    ]
    table = pd.DataFrame(rows, columns=list(TIME_COLUMNS))
    return _in_order(table, _methods(steps), "time_start_s")


def _methods(statistics: pd.DataFrame) -> list[str]:
    return list(dict.fromkeys(statistics["method"]))


def _groups(statistics: pd.DataFrame, by: list[str]) -> Any:
    """Key, rows, and whether the rows are all objects' together."""
    names = [*CONDITION, "object", *by]
    for pooled in (True, False):
        table = statistics.assign(name=ALL if pooled else statistics["object"])
        for key, group in table.groupby([*CONDITION, "name", *by], sort=False):
            yield dict(zip(names, key, strict=True)), group, pooled


def _sampled(group: pd.DataFrame, value: str, pooled: bool) -> np.ndarray:
    """Samples of one method, shape (N,): an object alone is never averaged over its runs."""
    if not pooled:
        return group[value].to_numpy(dtype=float)
    return samples_alone(group, value)


def _quartiles(adds_m: np.ndarray) -> dict[str, Any]:
    q25, median, q75 = (1e3 * quantile(adds_m, q) for q in (0.25, 0.5, 0.75))
    return {
        "samples": len(adds_m),
        "adds_median_mm": median,
        "adds_q25_mm": q25,
        "adds_q75_mm": q75,
    }


def _summary(group: pd.DataFrame, pooled: bool) -> dict[str, Any]:
    def median(value: str) -> float:
        return quantile(_sampled(group, value, pooled), 0.5)

    adds = _sampled(group, "adds_median_m", pooled)
    low, high = median_interval(1e3 * adds) or (np.nan, np.nan)
    frames = int(group["frames"].sum())
    counted = ("frames", "frames_without_pose", "frames_not_held")
    return {
        "sequences": len(group),
        **{name: int(group[name].sum()) for name in counted},
        "share_below_5mm": int(group["frames_below_5mm"].sum()) / frames,
        "share_below_10mm": int(group["frames_below_10mm"].sum()) / frames,
        "auc_10cm": float((group["auc_10cm"] * group["frames"]).sum()) / frames,
        **_quartiles(adds),
        "adds_median_low_mm": low,
        "adds_median_high_mm": high,
        "add_median_mm": 1e3 * median("add_median_m"),
        "translation_median_mm": 1e3 * median("translation_median_m"),
        "rotation_median_deg": float(np.degrees(median("rotation_median_rad"))),
        **_consistency(group),
    }


def _consistency(group: pd.DataFrame) -> dict[str, float]:
    """Median over the sequences of their NEES, and shares of frames in each region; NaN where there is none."""
    known = group.dropna(subset="nees")
    frames = int(known["frames_with_covariance"].sum())
    shares = {
        f"share_{name.removeprefix('frames_')}": int(known[name].sum()) / frames
        if frames
        else np.nan
        for name in IN_REGION.values()
    }
    return {"nees": quantile(known["nees"].to_numpy(), 0.5) if frames else np.nan, **shares}


def _in_order(
    table: pd.DataFrame, methods: list[str], last: str, order: list[str] | None = None
) -> pd.DataFrame:
    """Sorted by condition and object, "all" first; methods as they were given; then by ``last``."""
    keys = table.assign(
        pooled=table["object"] != ALL,
        nth_method=table["method"].map(methods.index),
        nth=table[last].map(order.index) if order else table[last],
    )
    by = [*CONDITION, "pooled", "object", "nth_method", "nth"]
    return table.loc[keys.sort_values(by, kind="stable").index].reset_index(drop=True)
