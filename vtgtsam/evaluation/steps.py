# SPDX-License-Identifier: MIT
"""Each sequence over time: its errors in steps of half a second.

The paper compares methods at each time step of its sequences. Frames of other recordings come at other
instants, so a step here is half a second, and a sequence's value in it the median of its frames.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from .phases import TURNING
from .statistics import with_failures

STEP = 0.5  # [s]


def step_statistics(metrics: pd.DataFrame) -> pd.DataFrame:
    """Median ADD-S [m] of each method and step of one sequence's rows of ``metrics.parquet``.

    ``step`` k holds the frames from ``k * STEP`` to before ``(k + 1) * STEP`` after the sequence's first.
    A frame without a pose counts as infinitely wrong.
    """
    step = np.floor(metrics["time_rel"] / STEP + 1e-9).astype(int)  # 0.5 s is not before 0.5 s
    adds = pd.Series(with_failures(metrics["adds_m"]), index=metrics.index)
    medians = adds.groupby([metrics["method"], step.rename("step")], sort=False).median()
    first = metrics.iloc[0]
    names = {name: first[name] for name in ("sequence", "object", "dataset")}
    return medians.rename("adds_median_m").reset_index().assign(**names)


def turn_times(metrics: pd.DataFrame) -> tuple[float, float]:
    """When the hand begins and ends to turn [s] after the sequence's first frame; NaN where it does not."""
    times = metrics.loc[metrics["phase"] == TURNING, "time_rel"]
    return float(times.min()), float(times.max())
