# SPDX-License-Identifier: MIT
"""Which method is better than which, and whether that could be chance.

As in the paper (section IV-F): Wilcoxon's signed-rank test on paired ADD-S values, two-sided. A sample is
the median ADD-S of one sequence, or in dataset ``occ`` the mean of an object's runs (``units``). Holm's
correction spans the tests that are read together, those with a method that has memory apart from the paper's:

- ``tests.csv``: all comparisons and phases of one condition (dataset, tracker, noise scale);
- ``tests_time.csv``: all time steps of one comparison in one condition;
- ``tests_noise.csv``: all comparisons and noise scales of one phase, dataset and tracker.

A tracker that was handed fused poses back has touch in what it sees, so methods are not compared on its recordings.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
import scipy.stats

from ..vision.hand_back import BACK
from .bootstrap import median_interval
from .collect import CONDITION
from .phases import AFTER, BEFORE
from .statistics import PHASES, quantile
from .steps import STEP
from .units import samples, unit_of

FEWEST = 6  # pairs; with five, the smallest two-sided p of the signed-rank test is 2 / 2^5 = 0.0625

_RESULT = ("comparison", "unit", "n", "n_better", "statistic", "p", "p_holm", "effect_size", "note")
_DIFFERENCE = ("difference_mm", "difference_low_mm", "difference_high_mm")

COLUMNS = (*CONDITION, "phase", *_RESULT[:-1], *_DIFFERENCE, "note")
MEMORY = "+mem"  # in the name of a method that remembers
NOT_COMPARED = "the tracker was handed fused poses back: no comparison of methods"
TIME_COLUMNS = (*CONDITION, "time_start_s", "time_end_s", *_RESULT)
NOISE_COLUMNS = (*CONDITION, "phase", *_RESULT)


def paired_tests(statistics: pd.DataFrame) -> pd.DataFrame:
    """Test each method against each one given before it, per condition and phase.

    ``n`` counts pairs, ``n_better`` those where the first-named method's error is smaller.
    ``effect_size`` is the matched-pairs rank-biserial correlation in [-1, 1], positive where the
    first-named method is better. ``difference_mm`` is the median of how much smaller its error is, with
    its 95 % bootstrap interval. What cannot be tested has no p, and ``note`` says why.
    """
    tests = []
    for condition, table in _conditions(statistics):
        family = [
            condition
            | {"phase": phase}
            | _compare(table[table["phase"] == phase], *pair, with_difference=True)
            for phase in PHASES
            for pair in _pairs(statistics)
        ]
        _add_holm(family)
        tests += family
    return pd.DataFrame(tests, columns=list(COLUMNS))


def time_tests(steps: pd.DataFrame) -> pd.DataFrame:
    """Test each method against each one given before it, per condition and time step."""
    tests = []
    for condition, table in _conditions(steps):
        by_step = {int(step): table[table["step"] == step] for step in table["step"].unique()}
        for pair in _pairs(steps):
            family = [
                condition
                | {"time_start_s": step * STEP, "time_end_s": (step + 1) * STEP}
                | _compare(by_step[step], *pair)
                for step in sorted(by_step)
            ]
            _add_holm(family)
            tests += family
    return pd.DataFrame(tests, columns=list(TIME_COLUMNS))


def noise_tests(statistics: pd.DataFrame) -> pd.DataFrame:
    """Test each method against each one given before it, per noise scale; empty where there is only one.

    The paper looks at the time before the hand turns; what follows is tested as well.
    """
    tests = []
    for _, table in statistics.groupby(["dataset", "tracker"], sort=True):
        if table["noise_scale"].nunique() < 2:
            continue
        for phase in (BEFORE, AFTER):
            family = [
                condition | {"phase": phase} | _compare(scale, *pair)
                for condition, scale in _conditions(table[table["phase"] == phase])
                for pair in _pairs(statistics)
            ]
            _add_holm(family)
            tests += family
    return pd.DataFrame(tests, columns=list(NOISE_COLUMNS))


def signed_rank(differences: np.ndarray) -> dict[str, Any]:
    """Wilcoxon's signed-rank test of paired differences (N,) [m]; positive ones favour the first method.

    Differences count in whole nanometres: what is left of a difference by rounding is none, and differences
    that are equal but for it share their rank.
    """
    differences = nanometres(differences)
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


def nanometres(differences: np.ndarray) -> np.ndarray:
    """Differences [m] in whole nanometres; below one they are 0."""
    scaled = differences * 1e9
    return np.where(np.abs(scaled) < 1.0, 0.0, np.round(scaled))


def _told(differences: np.ndarray) -> np.ndarray:
    """Differences [m] without what rounding leaves of equal ones."""
    return np.where(nanometres(differences) == 0.0, 0.0, differences)


def holm(p: np.ndarray) -> np.ndarray:
    """Holm's step-down correction of p values, shape (N,)."""
    order = np.argsort(p, kind="stable")
    scaled = p[order] * np.arange(len(p), 0, -1)
    corrected = np.empty_like(p)
    corrected[order] = np.minimum(np.maximum.accumulate(scaled), 1.0)
    return corrected


def _conditions(statistics: pd.DataFrame) -> Iterator[tuple[dict[str, Any], pd.DataFrame]]:
    for condition, table in statistics.groupby(list(CONDITION), sort=True):
        yield dict(zip(CONDITION, condition, strict=True)), table


def _pairs(statistics: pd.DataFrame) -> list[tuple[str, str]]:
    """Each method with each one given before it."""
    methods = dict.fromkeys(statistics["method"])
    return [(better, baseline) for baseline, better in combinations(methods, 2)]


def _compare(
    table: pd.DataFrame, better: str, baseline: str, with_difference: bool = False
) -> dict[str, Any]:
    """One test on the rows of one condition, one phase or step."""
    table = table[table["method"].isin([better, baseline])]
    unit = unit_of(table["dataset"].iloc[0]) if len(table) else "sequence"
    pairs = samples(table).reindex(columns=[better, baseline])
    a, b = pairs[better].to_numpy(dtype=float), pairs[baseline].to_numpy(dtype=float)
    with np.errstate(invalid="ignore"):
        differences = np.where(a == b, 0.0, b - a)  # two infinite errors are equal
    n_better = int((nanometres(differences) > 0).sum())
    result: dict[str, Any] = {"comparison": f"{better} vs {baseline}", "unit": unit}
    if table["tracker"].astype(str).str.endswith(BACK).any():
        return result | {"n": 0, "n_better": 0, "note": NOT_COMPARED}
    result |= {"n": len(a), "n_better": n_better} | signed_rank(differences)
    missing = table["sequence"].nunique() - _both(table)
    if missing:
        noun = "sequence" if missing == 1 else "sequences"
        words = f"{missing} {noun} left out, in which only one of the two has a value"
        result["note"] = "; ".join(filter(None, (result["note"], words)))
    return result | _difference(1e3 * _told(differences)) if with_difference else result


def _both(table: pd.DataFrame) -> int:
    """Sequences in which two methods have a value."""
    known = table.dropna(subset="adds_median_m")
    return int((known.groupby("sequence")["method"].nunique() == 2).sum())


def _difference(differences_mm: np.ndarray) -> dict[str, float]:
    if len(differences_mm) == 0:
        return {}
    interval = median_interval(differences_mm) or (np.nan, np.nan)
    return dict(zip(_DIFFERENCE, (quantile(differences_mm, 0.5), *interval), strict=True))


def _add_holm(tests: list[dict[str, Any]]) -> None:
    """Holm's correction in two families: the paper's comparisons, and those with a method that has memory."""
    for memory in (False, True):
        family = [t for t in tests if "p" in t and (MEMORY in t["comparison"]) == memory]
        for test, corrected in zip(family, holm(np.array([t["p"] for t in family])), strict=True):
            test["p_holm"] = float(corrected)
