# SPDX-License-Identifier: MIT
"""What was wrong with a sequence's measurements and when, from the stored estimates."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from . import store
from .parquet import column_names

MOST = 6  # different faults of one sequence; of more, the ones that last longest are kept


def read_faults(out: Path, sequence: str, method: str) -> dict[str, np.ndarray]:
    """Instants after the sequence's first frame [s] at which a method named each fault, the longest first.

    Empty where nothing was named, and in results from before faults were stored.
    """
    path = store.estimates_path(out, sequence)
    names = column_names(path)  # none where it is damaged, which reading it says
    if not path.is_file() or (names and "faults" not in names):
        return {}
    table, _ = store.read_part(path, columns=["method", "time_rel", "faults"])
    found: dict[str, list[float]] = {}
    for row in table.to_pylist():
        if row["method"] == method:
            for word in row["faults"] or ():
                found.setdefault(word, []).append(row["time_rel"])
    longest = sorted(found, key=lambda word: (-len(found[word]), word))[:MOST]
    return {word: np.array(found[word]) for word in longest}
