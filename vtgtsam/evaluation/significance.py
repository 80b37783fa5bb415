# SPDX-License-Identifier: MIT
"""``tests.csv``: which method is better than which, and whether that could be chance.

As in the paper (section IV-F): Wilcoxon's signed-rank test on paired ADD-S values, two-sided. A sample is
the median ADD-S of one sequence. In dataset ``occ`` the runs of one object start alike and are not
independent: there a sample is the mean over an object's runs. Holm's correction spans all tests of one
condition (dataset, tracker, noise scale).
"""

from __future__ import annotations

from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
import scipy.stats

from .statistics import PHASES
from .summary import CONDITION

FEWEST = 6  # pairs; with five, the smallest two-sided p of the signed-rank test is 2 / 2^5 = 0.0625

COLUMNS = (
    *CONDITION,
    "phase",
    "comparison",
    "unit",
    "n",
    "n_better",
    "statistic",
    "p",
    "p_holm",
    "effect_size",
    "note",
)


def paired_tests(statistics: pd.DataFrame) -> pd.DataFrame:
    """Test each method against each one given before it, per condition and phase.

    ``n`` counts pairs, ``n_better`` those where the first-named method's error is smaller.
    ``effect_size`` is the matched-pairs rank-biserial correlation in [-1, 1], positive where the
    first-named method is better. What cannot be tested has no p, and ``note`` says why.
    """
    methods = list(dict.fromkeys(statistics["method"]))
    tests = []
    for condition, table in statistics.groupby(list(CONDITION), sort=True):
        dataset = str(condition[0])
        family = [
            dict(zip(CONDITION, condition, strict=True))
            | {"phase": phase, "comparison": f"{better} vs {baseline}"}
            | _compare(table[table["phase"] == phase], better, baseline, dataset)
            for phase in PHASES
            for baseline, better in combinations(methods, 2)
        ]
        _add_holm(family)
        tests += family
    return pd.DataFrame(tests, columns=list(COLUMNS))


def signed_rank(differences: np.ndarray) -> dict[str, Any]:
    """Wilcoxon's signed-rank test of paired differences (N,); positive ones favour the first method."""
    unequal = differences[differences != 0]
    notes = []
    if len(unequal) < len(differences):
        notes.append(
            f"{len(differences) - len(unequal)} of {len(differences)} pairs equal, left out"
        )
    if len(differences) == 0:
        return {"note": "no pairs: nothing to test"}
    if len(unequal) == 0:
        return {"effect_size": 0.0, "note": f"all {len(differences)} pairs equal: nothing to test"}
    if len(unequal) < FEWEST:
        notes.append(f"too few pairs for p < 0.05: {len(unequal)} differ, {FEWEST} needed")
    result = scipy.stats.wilcoxon(unequal)
    ranks = scipy.stats.rankdata(np.abs(unequal))
    return {
        "statistic": float(result.statistic),
        "p": float(result.pvalue),
        "effect_size": float((np.sign(unequal) * ranks).sum() / ranks.sum()),
        "note": "; ".join(notes),
    }


def holm(p: np.ndarray) -> np.ndarray:
    """Holm's step-down correction of p values, shape (N,)."""
    order = np.argsort(p, kind="stable")
    scaled = p[order] * np.arange(len(p), 0, -1)
    corrected = np.empty_like(p)
    corrected[order] = np.minimum(np.maximum.accumulate(scaled), 1.0)
    return corrected


def _compare(table: pd.DataFrame, better: str, baseline: str, dataset: str) -> dict[str, Any]:
    unit = "object" if dataset == "occ" else "sequence"
    medians = table.pivot(index=["object", "sequence"], columns="method", values="adds_median_m")
    medians = medians.reindex(columns=[better, baseline]).dropna()
    if unit == "object":
        medians = medians.groupby("object").mean()
    a, b = medians[better].to_numpy(), medians[baseline].to_numpy()
    with np.errstate(invalid="ignore"):
        differences = np.where(a == b, 0.0, b - a)  # two infinite errors are equal
    counts = {"unit": unit, "n": len(a), "n_better": int((a < b).sum())}
    return counts | signed_rank(differences)


def _add_holm(family: list[dict[str, Any]]) -> None:
    tested = [test for test in family if "p" in test]
    for test, corrected in zip(tested, holm(np.array([t["p"] for t in tested])), strict=True):
        test["p_holm"] = float(corrected)
