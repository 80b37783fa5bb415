# SPDX-License-Identifier: MIT
"""The paper's claims, each as a row with its figure and p, from what ``vtgtsam evaluate`` stored.

The paper (section IV) says of ``vis+tac+pen``: more accurate than ``vis`` and than ``vis+pen`` (p < 0.0001, on both
datasets), than ``vis`` at each instant after the hand has turned (p < 0.05), as accurate before, and more
accurate at each of five noise scales.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pandas as pd

from sim.constants import TURN_END, TURN_START
from vtgtsam.vision.hand_back import BACK

from .report import save, table

OURS, VISION, NO_TOUCH = "vis+tac+pen", "vis", "vis+pen"
CONDITION = ["dataset", "tracker", "noise_scale"]
STEP_P = 0.05  # the paper's level for single instants


def run(results: Mapping[str, Path]) -> None:
    """Read evaluations by name, and write ``claims.md`` and ``claims.json``."""
    rows = [row for name, folder in results.items() for row in claims(name, folder)]
    save("claims", table(rows), {"rows": rows}, {})


def claims(name: str, folder: Path) -> Iterator[dict[str, Any]]:
    """A row for each condition of an evaluation, before and after the turn."""
    summary, tests, steps = (
        pd.read_csv(folder / f"{file}.csv") for file in ("summary", "tests", "tests_time")
    )
    summary = summary[summary["object"] == "all"]
    handed_back = summary["tracker"].astype(str).str.endswith(BACK)
    summary = summary[~handed_back]  # what it sees has touch in it: no method is compared on it
    for condition, group in summary.groupby(CONDITION, dropna=False):
        chosen = dict(zip(CONDITION, condition, strict=True))
        for phase in ("before", "after"):
            yield {
                "recordings": name,
                **chosen,
                "phase": phase,
                **_medians(group[group["phase"] == phase]),
                **_paired(_where(tests, chosen | {"phase": phase})),
                f"instants with p < {STEP_P}": _instants(_where(steps, chosen), phase),
            }


def _where(rows: pd.DataFrame, values: Mapping[str, Any]) -> pd.DataFrame:
    for column, value in values.items():
        rows = rows[rows[column] == value]
    return rows


def _medians(rows: pd.DataFrame) -> dict[str, Any]:
    medians = dict(zip(rows["method"], rows["adds_median_mm"], strict=True))
    return {f"{method} [mm]": medians[method] for method in (VISION, NO_TOUCH, OURS)}


def _paired(tests: pd.DataFrame) -> dict[str, Any]:
    """How many pairs are better, and p: of the test itself, as in the paper, not corrected."""
    found: dict[str, Any] = {}
    for other in (VISION, NO_TOUCH):
        for test in _where(tests, {"comparison": f"{OURS} vs {other}"}).itertuples():
            found[f"better than {other}"] = f"{test.n_better} of {test.n}"
            found[f"p against {other}"] = f"{test.p:.1g}"
    return found


def _instants(steps: pd.DataFrame, phase: str) -> str:
    """At how many time steps ours is better, and worse, than vision with p below ``STEP_P``."""
    steps = _where(steps, {"comparison": f"{OURS} vs {VISION}"})
    inside = steps["time_start_s"] >= TURN_END
    if phase == "before":
        inside = steps["time_end_s"] <= TURN_START
    steps = steps[inside]
    clear = steps[steps["p"] < STEP_P]
    better = int((clear["effect_size"] > 0).sum())
    return f"{better} better, {len(clear) - better} worse, of {len(steps)}"
