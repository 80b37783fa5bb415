# SPDX-License-Identifier: MIT
"""The tables as text for people: ADD-S in millimetres."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pandas as pd

from .collect import CONDITION
from .phases import AFTER, BEFORE
from .significance import FEWEST
from .statistics import ALL
from .tables import Tables


@dataclass(frozen=True)
class _Column:
    title: str
    phase: str
    value: str  # column of the summary


_TURNED = (
    _Column("median\nbefore turn", BEFORE, "adds_median_mm"),
    _Column("median\nafter turn", AFTER, "adds_median_mm"),
    _Column("75 %\nafter turn", AFTER, "adds_q75_mm"),
    _Column("< 5 mm\nafter turn", AFTER, "share_below_5mm"),
    _Column("frames\nnot held", ALL, "frames_not_held"),
)
_NOT_TURNED = (
    _Column("median", ALL, "adds_median_mm"),
    _Column("75 %", ALL, "adds_q75_mm"),
    _Column("< 5 mm", ALL, "share_below_5mm"),
    _Column("frames\nnot held", ALL, "frames_not_held"),
)

_MOST_OBJECTS = 40  # in all conditions together; of more, each condition's sum is printed
_SHOWN = 3  # different notes, and different warnings

_LEGEND = """\
vis: the visual tracker alone; pen: object and hand do not overlap; tac: pads in contact touch the object;
mem: frames hold each other up.
ADD-S: mean distance of the object's vertices at the estimate to its surface at the truth. Median and 75 %
quartile over the sequences' medians; < 5 mm: share of frames; not held: frames in which nothing held the
pose (no vision, or vision too far off to count, and too few pads), which are counted with their errors."""

_TURN = "The turn is the hand's: it brings the fingers between camera and object."


def tables_text(tables: Tables) -> str:
    """All conditions' tables with what the tests say, and a legend."""
    blocks = []
    named = tables.summary[tables.summary["object"] != ALL]
    brief = len(named.groupby([*CONDITION, "object"])) > _MOST_OBJECTS
    for condition, summary in tables.summary.groupby(list(CONDITION), sort=False):
        values = dict(zip(CONDITION, map(str, condition), strict=True))
        tests = tables.tests
        for name, value in values.items():
            tests = tests[tests[name] == value]
        blocks.append(
            "\n".join(
                [
                    _title(values, summary),
                    "",
                    *_table(summary, brief),
                    "",
                    *_coverage(summary),
                    *_tests(tests),
                ]
            )
        )
    turn = f"\n{_TURN}" if (tables.summary["phase"] == AFTER).any() else ""
    blocks.append(_LEGEND + turn if blocks else "no ADD-S to show")
    if brief:
        blocks.append("Each object by itself is in summary.csv and in the report.")
    return "\n".join(["\n\n".join(blocks), *_notes(tables.sequences)])


def _title(condition: dict[str, str], summary: pd.DataFrame) -> str:
    words = [f"{name.replace('_', ' ')} {value}" for name, value in condition.items() if value]
    count = summary.loc[summary["object"] == ALL, "sequences"].max()
    sequences = "1 sequence" if count == 1 else f"{count} sequences"
    return ", ".join([f"ADD-S [mm] of {sequences}", *words])


def _table(summary: pd.DataFrame, brief: bool) -> Iterator[str]:
    columns = _TURNED if (summary["phase"] == AFTER).any() else _NOT_TURNED
    cells = [
        [*pair, *(_cell(rows, column) for column in columns)]
        for pair, rows in _rows(summary, brief)
    ]
    heads = [["", "object"], ["", "method"], *(column.title.split("\n") for column in columns)]
    lines = [[("", *head)[-2:][i] for head in heads] for i in range(2)]
    if all(not cell for cell in lines[0]):
        lines = lines[1:]
    widths = [max(len(row[i]) for row in [*lines, *cells]) for i in range(len(heads))]
    for row in [*lines, *cells]:
        yield "  ".join(_aligned(row, widths)).rstrip()


def _rows(summary: pd.DataFrame, brief: bool) -> Iterator[tuple[list[str], pd.DataFrame]]:
    """Label and summary rows of each line of the table; one object alone needs no line of its own."""
    objects = summary["object"].nunique() - 1  # "all" is none
    single = objects == 1
    for name, of_object in summary.groupby("object", sort=False):
        if (single and name == ALL) or (brief and name != ALL and not single):
            continue
        label = "all objects" if name == ALL else str(name)
        label += f" ({of_object['sequences'].max()})"
        for method, rows in of_object.groupby("method", sort=False):
            yield [label, str(method)], rows
            label = ""


def _cell(rows: pd.DataFrame, column: _Column) -> str:
    found = rows[rows["phase"] == column.phase]
    if found.empty:
        return "-"
    value = found[column.value].iloc[0]
    if column.value == "share_below_5mm":
        return f"{100 * value:.0f} %"
    if column.value == "frames_not_held":
        return f"{value} ({100 * value / found['frames'].iloc[0]:.0f} %)" if value else "0"
    return _mm(value)


def _coverage(summary: pd.DataFrame) -> Iterator[str]:
    """How often each method's covariance holds the truth."""
    rows = summary[(summary["object"] == ALL) & summary["share_in_95"].notna()]
    after = (rows["phase"] == AFTER).any()
    rows = rows[rows["phase"] == (AFTER if after else ALL)]
    if len(rows):
        shares = [
            f"{row['method']} {100 * row['share_in_95']:.0f} %" for row in rows.to_dict("records")
        ]
        when = " after the turn" if after else ""
        yield f"Frames whose 95 % region holds the truth{when}: {', '.join(shares)}."


def _mm(value: float) -> str:
    if np.isinf(value):
        return "no pose"
    return f"{value:.2f}" if value < 10 else f"{value:.1f}"


def _aligned(row: Sequence[str], widths: Sequence[int], left: int = 2) -> list[str]:
    return [
        cell.ljust(width) if i < left else cell.rjust(width)
        for i, (cell, width) in enumerate(zip(row, widths, strict=True))
    ]


def _tests(tests: pd.DataFrame) -> Iterator[str]:
    """What the paired tests say, after the turn where there was one."""
    tests = tests[tests["n"] > 0]
    after = tests[tests["phase"] == AFTER]
    shown = after if len(after) else tests[tests["phase"] == ALL]
    if len(shown) and (shown["n"] < FEWEST).all():
        n, unit = shown["n"].max(), shown["unit"].iloc[0]
        yield f"With {n} {unit}{'' if n == 1 else 's'} nothing can be said about chance: at least {FEWEST} are needed."
        return
    if len(shown):
        when = " after the turn" if len(after) else ""
        yield f"Paired{when}, p of Wilcoxon's test (after Holm's correction):"
    rows = [_test(test) for test in shown.to_dict("records")]
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    for row in rows:
        yield "  " + "  ".join(_aligned(row, widths, left=len(row))).rstrip()


def _test(test: Mapping[Hashable, Any]) -> list[str]:
    wins = f"smaller in {test['n_better']} of {test['n']} {test['unit']}s"
    chance = "" if pd.isna(test["p"]) else f"p = {test['p']:.2g} ({test['p_holm']:.2g})"
    return [test["comparison"], wins, chance, test["note"]]


def _notes(sequences: pd.DataFrame) -> Iterator[str]:
    """What is missing in some sequences, each thing once."""
    for column in ("note", "warnings"):
        texts = sequences.loc[sequences[column] != "", column]
        for text, count in texts.value_counts(sort=False).head(_SHOWN).items():
            yield f"{count} of {len(sequences)} sequences: {text}"
        if texts.nunique() > _SHOWN:
            yield "... and more: see sequences.csv"
