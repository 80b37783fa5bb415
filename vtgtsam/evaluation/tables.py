# SPDX-License-Identifier: MIT
"""All tables from the stored errors, without estimating anything."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import pandas as pd

from ..atomic import write_text
from ..exceptions import VtgtsamError
from ..input.door import reading
from ..input.plain import plain
from . import folder, store
from .collect import CONDITION, Collected, collect
from .significance import noise_tests, paired_tests, time_tests
from .summary import over_time, summarise

LONGEST_CELL = 5000  # [characters] of a note or a problem
_UNITS = {"_m": ("_mm", 1e3), "_rad": ("_deg", 57.29577951308232)}  # in tables for people


@dataclass(frozen=True)
class Tables:
    """What a run says in the end.

    Attributes:
        collected: Each sequence in a few numbers: what the other tables are made from.
        summary: As ``summary.csv``.
        over_time: As ``over_time.csv``.
        tests: As ``tests.csv``.
        tests_time: As ``tests_time.csv``.
        tests_noise: As ``tests_noise.csv``.
        sequences: As ``sequences.csv``: what was evaluated, what failed and why.
    """

    collected: Collected
    summary: pd.DataFrame
    over_time: pd.DataFrame
    tests: pd.DataFrame
    tests_time: pd.DataFrame
    tests_noise: pd.DataFrame
    sequences: pd.DataFrame

    @property
    def failed(self) -> dict[str, str]:
        """Sequences that failed, and why."""
        failed = self.sequences[self.sequences["problem"] != ""]
        return dict(zip(failed["sequence"], failed["problem"], strict=True))


def make_tables(out: Path) -> Tables:
    """Write all tables anew from what a run has stored.

    Raises:
        VtgtsamError: The folder holds no finished run, or files of others in the place of tables.
    """
    check_finished(out)
    with reading(f"what is stored in {out}", VtgtsamError):
        tables = _tables(out)
    folder.claim(out, set(store.TABLES) - {store.METRICS, store.SEQUENCES})
    write_csv(out / store.PER_SEQUENCE, per_sequence(tables.collected.phases))
    write_csv(out / store.SUMMARY, tables.summary)
    write_csv(out / store.OVER_TIME, tables.over_time)
    write_csv(out / store.TESTS, tables.tests)
    write_csv(out / store.TESTS_TIME, tables.tests_time)
    write_csv(out / store.TESTS_NOISE, tables.tests_noise)
    return tables


def _tables(out: Path) -> Tables:
    sequences = _read_sequences(out)
    collected = collect(out, sequences)
    return Tables(
        collected,
        summarise(collected.phases),
        over_time(collected.steps),
        paired_tests(collected.phases),
        time_tests(collected.steps),
        noise_tests(collected.phases),
        sequences,
    )


def per_sequence(statistics: pd.DataFrame) -> pd.DataFrame:
    """``per_sequence.csv``: statistics of each sequence, method and phase in units for people."""
    first = ["sequence", *CONDITION, "object", "method", "phase"]
    table = statistics[[*first, *(name for name in statistics if name not in first)]].copy()
    for name in map(str, statistics.columns):
        for unit, (shown, factor) in _UNITS.items():
            if name.endswith(unit):
                table[name] *= factor
                table = table.rename(columns={name: name.removesuffix(unit) + shown})
    return table


def write_csv(path: Path, table: pd.DataFrame) -> None:
    """Write a table with its column names, empty where there is no value."""
    write_text(path, table.to_csv(index=False, lineterminator="\n"))


def check_finished(out: Path) -> None:
    """Refuse a folder without a finished run, and one whose stored results are damaged.

    Raises:
        VtgtsamError: It is such a folder.
    """
    built_on = (store.SEQUENCES, store.METRICS)
    if not all((out / name).is_file() for name in built_on):
        raise VtgtsamError(
            f"{out} holds no finished evaluation; run `vtgtsam evaluate --out {out}`"
        )
    folder.verify(out, [*built_on, store.CONFIG])


def _read_sequences(out: Path) -> pd.DataFrame:
    table = pd.read_csv(out / store.SEQUENCES, dtype=str, keep_default_na=False)
    missing = {"sequence", "object", "problem", "note", "warnings", *CONDITION} - set(table)
    if missing:
        raise VtgtsamError(
            f"{out / store.SEQUENCES} lacks the columns {', '.join(sorted(missing))}; "
            "`vtgtsam evaluate` with the same recordings makes it again from what is stored"
        )
    doubles = sorted(set(table["sequence"][table["sequence"].duplicated()]))
    if doubles:
        raise VtgtsamError(
            f"{out / store.SEQUENCES} lists {plain(', '.join(doubles))} more than once; "
            "`vtgtsam evaluate` with the same recordings makes it again from what is stored"
        )
    for name in table.columns.drop("sequence"):  # which names its files
        table[name] = [plain(text, LONGEST_CELL) for text in table[name]]
    return table
