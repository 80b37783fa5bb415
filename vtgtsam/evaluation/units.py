# SPDX-License-Identifier: MIT
"""What one sample is: a sequence, or in dataset ``occ`` the mean of an object's runs.

The runs of one object start alike in ``occ`` and are not independent, so the paper averages over them
(section IV-F). Medians, intervals, tests and figures all count the same samples.
"""

from __future__ import annotations

import numpy as np
import pandas as pd

AVERAGED = "occ"  # the dataset whose runs of one object start alike


def unit_of(dataset: str) -> str:
    """Name of one sample: "sequence" or "object"."""
    return "object" if dataset == AVERAGED else "sequence"


def samples(statistics: pd.DataFrame, value: str = "adds_median_m") -> pd.DataFrame:
    """A row a sample and a column a method, from rows of one condition, one phase or step.

    A sequence in which a method has no value counts for no method: samples are compared in pairs.
    """
    methods = list(dict.fromkeys(statistics["method"]))
    table = statistics.pivot(index=["object", "sequence"], columns="method", values=value)
    table = table.reindex(columns=methods).dropna()
    return table.groupby("object").mean() if _averaged(statistics) else table


def samples_alone(statistics: pd.DataFrame, value: str) -> np.ndarray:
    """The samples of one method, shape (N,), as ``samples`` has them in its column, from rows of that method alone."""
    known = statistics.dropna(subset=value).sort_values(["object", "sequence"])
    values = known.groupby("object")[value].mean() if _averaged(statistics) else known[value]
    return values.to_numpy(dtype=float)


def _averaged(statistics: pd.DataFrame) -> bool:
    return len(statistics) > 0 and unit_of(statistics["dataset"].iloc[0]) == "object"
