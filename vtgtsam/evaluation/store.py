# SPDX-License-Identifier: MIT
"""Where a run keeps what, and which sequences it has done already.

A sequence is done when its seal, which is written last, carries the key that the sequence has now and the
digests that its files have: Parquet's own checksums leave out much of a file. All files appear whole or not at
all, so a run may be killed at any moment.
"""

from __future__ import annotations

import hashlib
import json
import logging
from collections.abc import Iterable
from pathlib import Path, PurePosixPath
from typing import Any

import pyarrow as pa

from ..atomic import write_text
from .parquet import DamagedError, damaged, read_about, read_table, write_table

logger = logging.getLogger(__name__)

MARK = ".vtgtsam"  # the folder that a results folder is known by

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

_KINDS = ("estimates", "metrics")
TABLES = (METRICS, SEQUENCES, PER_SEQUENCE, SUMMARY, OVER_TIME, TESTS, TESTS_TIME, TESTS_NOISE)
FROM_ALL = (*TABLES, CONFIG, REPORT)  # made from all sequences together, with FIGURES


def estimates_path(out: Path, sequence: str) -> Path:
    """One sequence's estimates."""
    return out / "estimates" / f"{sequence}.parquet"


def metrics_path(out: Path, sequence: str) -> Path:
    """One sequence's part of ``metrics.parquet``."""
    return out / "metrics" / f"{sequence}.parquet"


def keep(
    out: Path, sequence: str, estimates: pa.Table, metrics: pa.Table, about: dict[str, Any]
) -> None:
    """Store one sequence's results."""
    seal = _seal_path(out, sequence)
    seal.unlink(missing_ok=True)  # not done until both files are new
    write_table(estimates_path(out, sequence), estimates, about)
    write_table(metrics_path(out, sequence), metrics, about)
    digests = {kind: _sha256(out / kind / f"{sequence}.parquet") for kind in _KINDS}
    write_text(seal, json.dumps({"about": about, "sha256": digests}, sort_keys=True) + "\n")


def done(out: Path, sequence: str, key: str) -> dict[str, Any] | None:
    """What is stored of a sequence with this key, or None where it has to be computed."""
    sealed = read_seal(_seal_path(out, sequence))
    if sealed is None or sealed["about"].get("key") != key:
        return None
    for kind in _KINDS:
        try:
            _verify(out / kind / f"{sequence}.parquet", sealed)
        except FileNotFoundError:
            return None
        except DamagedError as error:
            logger.warning("%s", error)
            return None
    about = read_about(metrics_path(out, sequence))  # which the digest covers
    return about if about is not None and about.get("key") == key else None


def read_part(path: Path, columns: list[str] | None = None) -> tuple[pa.Table, dict[str, Any]]:
    """A sequence's estimates or metrics, or some columns of them, and the description stored with them.

    Raises:
        FileNotFoundError: There is no such file.
        DamagedError: It cannot be read, or is not what was written, as far as that is known.
    """
    sealed = read_seal(_seal_path(path.parents[1], path.stem))
    if sealed is not None:
        _verify(path, sealed)
    return read_table(path, columns)


def _verify(path: Path, sealed: dict[str, Any]) -> None:
    if sealed["sha256"].get(path.parent.name) != _sha256(path):
        raise damaged(path, "it is not what was written")


def read_seal(path: Path) -> dict[str, Any] | None:
    """A sequence's description and its files' digests, or None where there is none that can be read."""
    try:
        sealed = json.loads(path.read_bytes())
        if isinstance(sealed["about"], dict) and isinstance(sealed["sha256"], dict):
            return dict(sealed)
    except FileNotFoundError:
        return None
    except (ValueError, KeyError, TypeError, RecursionError):
        pass
    logger.warning("%s is damaged; `vtgtsam evaluate` makes it again", path)
    return None


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _seal_path(out: Path, sequence: str) -> Path:
    return out / MARK / "parts" / f"{sequence}.json"


def forget(out: Path, sequence: str) -> None:
    """Remove one sequence's results."""
    for name in parts(sequence):
        (out / name).unlink(missing_ok=True)


def parts(sequence: str) -> tuple[str, ...]:
    """One sequence's files, as paths below the run's folder."""
    return f"{MARK}/parts/{sequence}.json", *(f"{kind}/{sequence}.parquet" for kind in _KINDS)


def stored_sequences(names: Iterable[str]) -> set[str]:
    """Sequences of which anything is stored, ``names`` being all files of a run."""
    paths = (PurePosixPath(name) for name in names)
    return {path.stem for path in paths if path.parent.name in _KINDS}
