# SPDX-License-Identifier: MIT
"""Each sequence in a few numbers: the unit that summary and tests count.

Frames of one sequence resemble each other, so a sequence, not a frame, is one sample. Nothing is left out
to look better: a frame whose pose the estimator itself calls lost counts with its error, and a frame
without any pose counts as infinitely wrong.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pandas as pd

from .consistency import LEVELS, covered
from .phases import AFTER, BEFORE

ALL = "all"
PHASES = (ALL, BEFORE, AFTER)

IN_REGION = {level: f"frames_in_{level:.0%}".rstrip("%") for level in LEVELS}
AUC_LIMIT = 0.1  # [m], as PoseCNN (Xiang et al., RSS 2018, section V-B) and YCB-V count

NOT_HELD = (
    "waiting",
    "unobservable",
    "lost",
    "invalid",
)  # statuses in which nothing holds the pose


def sequence_statistics(metrics: pd.DataFrame) -> list[dict[str, Any]]:
    """One row for each method and phase of one sequence's rows of ``metrics.parquet``.

    A phase that the sequence does not have gives no row.
    """
    rows = []
    for method, of_method in metrics.groupby("method", sort=False):
        for phase in PHASES:
            frames = of_method if phase == ALL else of_method[of_method["phase"] == phase]
            if len(frames):
                rows.append({"method": method, "phase": phase} | _statistics(frames))
    first = metrics.iloc[0]
    return [{name: first[name] for name in ("sequence", "object", "dataset")} | row for row in rows]


def auc(errors_m: np.ndarray) -> float:
    """Area under the accuracy-threshold curve of errors (N,) [m] up to 10 cm, in [0, 1].

    As PoseCNN (Xiang et al., RSS 2018): the share of errors below a threshold, averaged over all thresholds
    from 0 to 10 cm. An error e is below a share 1 - e / 10 cm of the thresholds, so the area is the mean of
    that; no thresholds need to be sampled.
    """
    return float(np.clip(1.0 - errors_m / AUC_LIMIT, 0.0, None).mean())


def quantile(values: np.ndarray, q: float) -> float:
    """The q-quantile, linear between neighbours; unlike NumPy's it keeps infinite values apart."""
    ordered = np.sort(values)
    position = q * (len(ordered) - 1)
    low, high = ordered[int(np.floor(position))], ordered[int(np.ceil(position))]
    return float(low if low == high else low + (high - low) * (position % 1.0))


def _statistics(frames: pd.DataFrame) -> dict[str, Any]:
    adds = with_failures(frames["adds_m"])
    return {
        "frames": len(frames),
        "frames_without_pose": int(np.isinf(adds).sum()),
        "frames_not_held": int(frames["status"].isin(NOT_HELD).sum()),
        "frames_below_5mm": int((adds < 0.005).sum()),
        "frames_below_10mm": int((adds < 0.010).sum()),
        "auc_10cm": auc(adds),
        "adds_median_m": quantile(adds, 0.5),
        "add_median_m": quantile(with_failures(frames["add_m"]), 0.5),
        "translation_median_m": quantile(with_failures(frames["translation_m"]), 0.5),
        "rotation_median_rad": quantile(with_failures(frames["rotation_rad"]), 0.5),
        **_consistency(frames),
    }


def _consistency(frames: pd.DataFrame) -> dict[str, Any]:
    """How many frames have a covariance, the mean NEES of them, and how many each region holds.

    Results from before it was stored have none.
    """
    if "nees" not in frames:
        return {"frames_with_covariance": 0, "nees": np.nan} | dict.fromkeys(IN_REGION.values(), 0)
    known = frames[frames["nees"].notna()]
    values, dof = known["nees"].to_numpy(dtype=float), known["nees_dof"].to_numpy(dtype=int)
    return {
        "frames_with_covariance": len(known),
        "nees": float(values.mean()) if len(known) else np.nan,
        **{name: int(covered(values, dof, level).sum()) for level, name in IN_REGION.items()},
    }


def with_failures(errors: pd.Series) -> np.ndarray:
    """Errors with an infinite one for each frame that has no pose."""
    values = errors.to_numpy(dtype=np.float64)
    return np.where(np.isnan(values), np.inf, values)
