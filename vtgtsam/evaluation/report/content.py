# SPDX-License-Identifier: MIT
"""The page's tables, from the run's tables."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from typing import Any

import pandas as pd

from ..collect import CONDITION
from ..groups import phase_name, phase_words
from ..phases import AFTER
from ..statistics import ALL, IN_REGION
from ..tables import Tables
from .cells import Cell, Head, Table, count, interval, percent, probability, value, word

MOST = 1000  # rows of a table; who needs more has the file
_PROBLEM = 1e299  # sorts a failed sequence behind all others

Row = Mapping[Hashable, Any]


def page_tables(tables: Tables) -> list[Table]:
    """All tables of the page; those that would be empty are left out."""
    found = [
        _methods(tables),
        _objects(tables),
        _consistency(tables),
        _tests(tables.tests, "tests", "Paired tests", "all comparisons of one condition"),
        _tests(
            tables.tests_noise,
            "tests-noise",
            "Paired tests over noise scales",
            "all comparisons and scales of one phase",
        ),
        _sequences(tables),
    ]
    return [table for table in found if table.rows]


def _conditions(tables: Tables | pd.DataFrame) -> list[str]:
    """The columns of the condition that tell rows apart."""
    table = tables.summary if isinstance(tables, Tables) else tables
    return [name for name in CONDITION if table[name].nunique() > 1]


_CONDITION_HEADS = {
    "dataset": Head("dataset", numeric=False),
    "tracker": Head("tracker", numeric=False),
    "noise_scale": Head("noise", "scale of the images' noise"),
}

_ERRORS = [
    Head("ADD-S [mm]", "median over the samples, with its 95 % bootstrap interval"),
    Head("position [mm]", "median error of the object's centre"),
    Head("rotation [°]", "median angle, smallest over the object's symmetries"),
    Head(
        "in 95\N{NO-BREAK SPACE}% region [%]",
        "frames whose covariance's 95 % region holds the truth; 95 is right",
    ),
    Head("quartiles [mm]", "25 % and 75 % of the samples' ADD-S"),
    Head("<\N{NO-BREAK SPACE}5\N{NO-BREAK SPACE}mm [%]", "frames with an ADD-S below 5 mm"),
    Head("<\N{NO-BREAK SPACE}1\N{NO-BREAK SPACE}cm [%]", "frames with an ADD-S below 1 cm"),
    Head("AUC [%]", "area under the accuracy-threshold curve of ADD-S up to 10 cm"),
    Head("ADD [mm]", "median; each vertex to itself, blind to symmetries"),
    Head("n", "sequences"),
    Head("not held", "frames in which nothing held the pose; they count with their error"),
    Head("no pose", "frames without a pose; they count as infinitely wrong"),
]


def _error_cells(row: Row) -> list[Cell]:
    median, q25, q75 = (row[f"adds_{name}_mm"] for name in ("median", "q25", "q75"))
    low, high = row["adds_median_low_mm"], row["adds_median_high_mm"]
    return [
        interval(median, low, high),
        value(row["translation_median_mm"]),
        value(row["rotation_median_deg"]),
        percent(row[f"share_{IN_REGION[0.95].removeprefix('frames_')}"]),
        Cell(f"{value(q25).text}–{value(q75).text}", value(q75).key),
        percent(row["share_below_5mm"]),
        percent(row["share_below_10mm"]),
        percent(row["auc_10cm"]),
        value(row["add_median_mm"]),
        count(row["sequences"]),
        count(row["frames_not_held"]),
        count(row["frames_without_pose"]),
    ]


def _condition_cells(row: Row, names: list[str]) -> list[Cell]:
    return [
        Cell(str(row[name]), _as_number(row[name]) if name == "noise_scale" else str(row[name]))
        for name in names
    ]


def _methods(tables: Tables) -> Table:
    names = _conditions(tables)
    rows = _told_apart(tables.summary[tables.summary["object"] == ALL])
    return Table(
        "methods",
        "Methods",
        "All objects together. Samples are sequences, or in dataset occ the means of an object's runs; "
        "shares and AUC are over frames. Click a column's title to sort.",
        [Head("method", numeric=False), Head("phase", numeric=False)]
        + [_CONDITION_HEADS[name] for name in names]
        + _ERRORS,
        [
            [word(row["method"]), word(phase_name(row["phase"]))]
            + _condition_cells(row, names)
            + _error_cells(row)
            for row in rows.to_dict("records")
        ],
    )


def _objects(tables: Tables) -> Table:
    names = _conditions(tables)
    phase = _main_phase(tables)
    rows = tables.summary
    rows = rows[(rows["object"] != ALL) & (rows["phase"] == phase)]
    return Table(
        "objects",
        "Objects",
        f"Each object {phase_words(phase)}; other phases are in summary.csv. {_cut(len(rows))}".strip(),
        [Head("object", numeric=False), Head("method", numeric=False)]
        + [_CONDITION_HEADS[name] for name in names]
        + _ERRORS,
        [
            [word(row["object"]), word(row["method"])]
            + _condition_cells(row, names)
            + _error_cells(row)
            for row in rows.head(MOST).to_dict("records")
        ],
    )


def _consistency(tables: Tables) -> Table:
    names = _conditions(tables)
    rows = _told_apart(tables.summary[tables.summary["object"] == ALL])
    rows = rows[rows["nees"].notna()]
    shares = {level: f"share_{name.removeprefix('frames_')}" for level, name in IN_REGION.items()}
    return Table(
        "consistency",
        "Uncertainty",
        "Whether poses are as uncertain as their covariances say; symmetries of the object count. NEES: squared "
        "error in units of the covariance, per degree of freedom; 1 is right, more promises too much, less too little.",
        [Head("method", numeric=False), Head("phase", numeric=False)]
        + [_CONDITION_HEADS[name] for name in names]
        + [Head("NEES", "median over the sequences of the mean over their frames")]
        + [
            Head(f"in {level:.0%} region [%]", "frames whose region holds the truth")
            for level in shares
        ],
        [
            [word(row["method"]), word(phase_name(row["phase"]))]
            + _condition_cells(row, names)
            + [value(row["nees"]), *(percent(row[share]) for share in shares.values())]
            for row in rows.to_dict("records")
        ],
    )


def _tests(tests: pd.DataFrame, name: str, title: str, family: str) -> Table:
    names = _conditions(tests)
    with_difference = "difference_mm" in tests
    tests = _told_apart(tests[tests["n"] > 0])
    heads = [Head("comparison", numeric=False), Head("phase", numeric=False)]
    heads += [_CONDITION_HEADS[condition] for condition in names]
    heads += [Head("smaller in", "pairs in which the first-named method's error is smaller")]
    if with_difference:
        words = (
            "median of how much smaller the first-named method's error is, with its 95 % interval"
        )
        heads += [Head("smaller by [mm]", words)]
    heads += [
        Head("statistic", "Wilcoxon's signed-rank statistic"),
        Head("p"),
        Head("p (Holm)", "after Holm's correction"),
        Head("effect size", "rank-biserial correlation, 1 where the first-named is always better"),
        Head("note", numeric=False),
    ]
    return Table(
        name,
        title,
        "Wilcoxon's signed-rank test of paired ADD-S, two-sided; Holm's correction spans "
        f"{family}.",
        heads,
        [_test_cells(row, names, with_difference) for row in tests.to_dict("records")],
    )


def _test_cells(row: Row, names: list[str], with_difference: bool) -> list[Cell]:
    wins = f"{row['n_better']} of {row['n']} {row['unit']}s"
    difference = []
    if with_difference:
        ends = row["difference_low_mm"], row["difference_high_mm"]
        difference = [interval(row["difference_mm"], *ends)]
    return [
        word(row["comparison"]),
        word(phase_name(row["phase"])),
        *_condition_cells(row, names),
        Cell(wins, row["n_better"] / row["n"]),
        *difference,
        Cell("–" if pd.isna(row["statistic"]) else f"{row['statistic']:g}", row["statistic"]),
        probability(row["p"]),
        probability(row["p_holm"]),
        value(row["effect_size"]),
        word(row["note"] or ""),
    ]


def _sequences(tables: Tables) -> Table:
    names = _conditions(tables)
    phase = _main_phase(tables)
    methods = tables.collected.methods
    statistics = tables.collected.phases
    of_phase = statistics[statistics["phase"] == phase]
    medians = of_phase.pivot(index="sequence", columns="method", values="adds_median_m")
    rows = tables.sequences.join(1e3 * medians, on="sequence")
    if methods:
        worst = rows[methods[-1]].fillna(_PROBLEM)
        rows = rows.loc[worst.sort_values(ascending=False, kind="stable").index]
    heads = [Head("sequence", numeric=False), Head("object", numeric=False)]
    heads += [_CONDITION_HEADS[name] for name in names] + [Head("frames")]
    heads += [Head(f"{method} [mm]", f"median ADD-S {phase_words(phase)}") for method in methods]
    heads += [Head("problems and notes", numeric=False)]
    return Table(
        "sequences",
        "Sequences",
        f"Median ADD-S {phase_words(phase)}, failed ones and the worst first. {_cut(len(rows))}".strip(),
        heads,
        [_sequence_cells(row, names, methods) for row in rows.head(MOST).to_dict("records")],
    )


def _sequence_cells(row: Row, names: list[str], methods: list[str]) -> list[Cell]:
    said = "; ".join(filter(None, (row["problem"], row["note"], row["warnings"])))
    frames = str(row["frames"])
    return [
        word(row["sequence"]),
        word(row["object"]),
        *_condition_cells(row, names),
        Cell(frames or "–", _as_number(frames or "0")),
        *(value(row[method]) for method in methods),
        word(said),
    ]


def _main_phase(tables: Tables) -> str:
    return AFTER if (tables.summary["phase"] == AFTER).any() else ALL


def _told_apart(rows: pd.DataFrame) -> pd.DataFrame:
    """Without phases that are the whole sequence, where no hand turned."""
    if (rows["phase"] == AFTER).any() or not (rows["phase"] == ALL).any():
        return rows
    return rows[rows["phase"] == ALL]


def _cut(rows: int) -> str:
    return f"The first {MOST} of {rows} rows; all are in the CSV files." if rows > MOST else ""


def _as_number(text: object) -> float:
    try:
        return float(str(text))
    except ValueError:
        return 0.0
