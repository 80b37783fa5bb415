# SPDX-License-Identifier: MIT
"""All sequences' stored errors in a few numbers each; one sequence's errors at a time are in memory."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from . import store
from .parquet import read_groups
from .statistics import sequence_statistics
from .steps import step_statistics, turn_times

CONDITION = (
    "dataset",
    "tracker",
    "noise_scale",
)  # recordings that differ in these are never pooled

_NAMES = ["method", "sequence", "object", "dataset"]


@dataclass(frozen=True)
class Collected:
    """What tables, tests and figures are made from. Every table has the columns of ``CONDITION``.

    Attributes:
        phases: A row a sequence, method and phase (``sequence_statistics``).
        steps: A row a sequence, method and time step (``step_statistics``).
        turns: A row a sequence: ``turn_start`` and ``turn_end`` [s], NaN where the hand does not turn.
    """

    phases: pd.DataFrame
    steps: pd.DataFrame
    turns: pd.DataFrame

    @property
    def methods(self) -> list[str]:
        """Names of the methods, in the order in which they were given."""
        return list(dict.fromkeys(self.phases["method"]))


def collect(out: Path, sequences: pd.DataFrame) -> Collected:
    """Reduce ``metrics.parquet``.

    Args:
        out: The run's folder.
        sequences: As ``sequences.csv``, which knows trackers and noise scales.
    """
    phases, steps, turns = [], [], []
    for metrics in _by_sequence(out):
        phases += sequence_statistics(metrics)
        steps.append(step_statistics(metrics))
        start, end = turn_times(metrics)
        names = {name: metrics[name].iloc[0] for name in ("sequence", "object", "dataset")}
        turns.append(names | {"turn_start": start, "turn_end": end})
    conditions = sequences.set_index("sequence")[[n for n in CONDITION if n != "dataset"]]
    return Collected(
        _table(phases, [*_NAMES, "phase", "adds_median_m"]).join(conditions, on="sequence"),
        (pd.concat(steps) if steps else _table([], [*_NAMES, "step", "adds_median_m"])).join(
            conditions, on="sequence"
        ),
        _table(turns, _NAMES[1:]).join(conditions, on="sequence"),
    )


def _table(rows: list[dict[str, object]], columns: list[str]) -> pd.DataFrame:
    return pd.DataFrame(rows) if rows else pd.DataFrame(columns=columns, dtype=object)


def _by_sequence(out: Path) -> Iterator[pd.DataFrame]:
    for table in read_groups(out / store.METRICS):
        yield table.to_pandas()
