# SPDX-License-Identifier: MIT
"""Summary and tests from the stored errors; one sequence's errors at a time are in memory."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import pandas as pd
import pyarrow.parquet as pq

from ..exceptions import VtgtsamError
from . import store
from .atomic import write_text
from .significance import paired_tests
from .statistics import sequence_statistics
from .summary import CONDITION, summarise


@dataclass(frozen=True)
class Tables:
    """What a run says in the end.

    Attributes:
        summary: As ``summary.csv``.
        tests: As ``tests.csv``.
        sequences: As ``sequences.csv``: what was evaluated, what failed and why.
    """

    summary: pd.DataFrame
    tests: pd.DataFrame
    sequences: pd.DataFrame

    @property
    def failed(self) -> dict[str, str]:
        """Sequences that failed, and why."""
        failed = self.sequences[self.sequences["problem"] != ""]
        return dict(zip(failed["sequence"], failed["problem"], strict=True))


def make_tables(out: Path) -> Tables:
    """Write ``summary.csv`` and ``tests.csv`` anew from what a run has stored.

    Raises:
        VtgtsamError: The folder holds no finished run.
    """
    sequences = _read_sequences(out)
    statistics = pd.DataFrame(
        [row for metrics in _by_sequence(out) for row in sequence_statistics(metrics)]
    )
    if statistics.empty:
        statistics = pd.DataFrame(columns=["method", "phase", "sequence", "object", "dataset"])
    conditions = sequences.set_index("sequence")[[name for name in CONDITION if name != "dataset"]]
    statistics = statistics.join(conditions, on="sequence")
    tables = Tables(summarise(statistics), paired_tests(statistics), sequences)
    write_csv(out / store.SUMMARY, tables.summary)
    write_csv(out / store.TESTS, tables.tests)
    return tables


def write_csv(path: Path, table: pd.DataFrame) -> None:
    """Write a table with its column names, empty where there is no value."""
    write_text(path, table.to_csv(index=False, lineterminator="\n"))


def _read_sequences(out: Path) -> pd.DataFrame:
    path = out / store.SEQUENCES
    if not path.is_file() or not (out / store.METRICS).is_file():
        raise VtgtsamError(
            f"{out} holds no finished evaluation; run `vtgtsam evaluate --out {out}`"
        )
    return pd.read_csv(path, dtype=str, keep_default_na=False)


def _by_sequence(out: Path) -> Iterator[pd.DataFrame]:
    with pq.ParquetFile(out / store.METRICS) as file:
        for group in range(file.num_row_groups):
            yield file.read_row_group(group).to_pandas()
