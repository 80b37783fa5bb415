# SPDX-License-Identifier: MIT
"""Where a run keeps what, and which sequences it has done already.

A sequence is done when its part of the metrics, which is written last, carries the key that the sequence
has now. All files appear whole or not at all, so a run may be killed at any moment.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path, PurePosixPath
from typing import Any

import pyarrow as pa

from .parquet import read_about, write_table

METRICS = "metrics.parquet"
SEQUENCES = "sequences.csv"
PER_SEQUENCE = "per_sequence.csv"
SUMMARY = "summary.csv"
OVER_TIME = "over_time.csv"
TESTS = "tests.csv"
TESTS_TIME = "tests_time.csv"
TESTS_NOISE = "tests_noise.csv"
CONFIG = "config.yaml"
REPORT = "report.html"
FIGURES = "figures"

TABLES = (METRICS, SEQUENCES, PER_SEQUENCE, SUMMARY, OVER_TIME, TESTS, TESTS_TIME, TESTS_NOISE)
FROM_ALL = (*TABLES, CONFIG, REPORT)  # made from all sequences together, with FIGURES


def estimates_path(out: Path, sequence: str) -> Path:
    """One sequence's estimates."""
    return out / parts(sequence)[0]


def metrics_path(out: Path, sequence: str) -> Path:
    """One sequence's part of ``metrics.parquet``."""
    return out / parts(sequence)[1]


def keep(
    out: Path, sequence: str, estimates: pa.Table, metrics: pa.Table, about: dict[str, Any]
) -> None:
    """Store one sequence's results."""
    metrics_path(out, sequence).unlink(missing_ok=True)  # not done until both files are new
    write_table(estimates_path(out, sequence), estimates, about)
    write_table(metrics_path(out, sequence), metrics, about)


def done(out: Path, sequence: str, key: str) -> dict[str, Any] | None:
    """What is stored of a sequence with this key, or None where it has to be computed."""
    for path in (estimates_path(out, sequence), metrics_path(out, sequence)):
        about = read_about(path)
        if about is None or about.get("key") != key:
            return None
    return about


def forget(out: Path, sequence: str) -> None:
    """Remove one sequence's results."""
    metrics_path(out, sequence).unlink(missing_ok=True)
    estimates_path(out, sequence).unlink(missing_ok=True)


def parts(sequence: str) -> tuple[str, str]:
    """One sequence's files, as paths below the run's folder."""
    return f"estimates/{sequence}.parquet", f"metrics/{sequence}.parquet"


def stored_sequences(names: Iterable[str]) -> set[str]:
    """Sequences of which anything is stored, ``names`` being all files of a run."""
    paths = (PurePosixPath(name) for name in names)
    return {path.stem for path in paths if path.parent.name in ("estimates", "metrics")}
