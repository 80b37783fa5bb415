# SPDX-License-Identifier: MIT
"""What the numbers say, in sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from ..groups import Group, phase_words
from ..significance import FEWEST
from ..statistics import ALL
from ..units import unit_of

SIGNIFICANT = 0.05

_SPACE = "\N{NO-BREAK SPACE}"


def verdict(group: Group) -> list[str]:
    """Which method is best, and whether that could be chance."""
    medians = _medians(group, group.scale)
    if len(medians) == 1:
        name, mm = next(iter(medians.items()))
        return [f"{_when(group)}, the median ADD-S of {name} is {millimetres(mm)}."]
    best = min(medians, key=lambda name: medians[name])
    others = [f"{millimetres(mm)} with {name}" for name, mm in medians.items() if name != best]
    rest = " and ".join(filter(None, (", ".join(others[:-1]), others[-1])))
    if np.isinf(medians[best]):
        return [f"{_when(group)}, no method has a pose in most sequences."]
    first = f"{_when(group)}, {best} has the smallest median ADD-S: {millimetres(medians[best])}, against {rest}."
    tests = group.rows(group.tables.tests)
    of_phase = tests[tests["phase"] == group.phase].to_dict("records")
    return [first, *_test_sentences(of_phase, best)]


def at_other_scales(group: Group) -> str:
    """The best methods at the noise scales that are not shown in detail; empty where there is none."""
    parts = []
    for scale in group.scales:
        medians = _medians(group, scale)
        if scale != group.scale and medians:
            best = min(medians, key=lambda name: medians[name])
            parts.append(f"{millimetres(medians[best])} with {best} at {scale}")
    return f"At the other noise scales the smallest is {', '.join(parts)}." if parts else ""


def scope(group: Group) -> str:
    """How many sequences of how many objects."""
    rows = group.at_all_scales(group.tables.collected.phases)
    at_one = rows[rows["noise_scale"] == group.scale]
    words = (
        f"{counted(at_one['sequence'].nunique(), 'sequence')} of "
        f"{counted(at_one['object'].nunique(), 'object')}"
    )
    if len(group.scales) > 1:
        words += f" at each of {len(group.scales)} noise scales"
    if unit_of(group.dataset) == "object":
        words += ", averaged over the runs of each object"
    return words


def p_value(p: float) -> str:
    """A p value as found: 0.031, or 1.5 × 10⁻⁵."""
    if p >= 0.001:
        return f"{p:.2g}"
    mantissa, exponent = f"{p:.1e}".split("e")
    power = str(int(exponent)).translate(str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹"))
    return f"{mantissa}{_SPACE}×{_SPACE}10{power}"


def millimetres(value: float) -> str:
    """A length with its unit."""
    return "no pose" if np.isinf(value) else f"{number(value)}{_SPACE}mm"


def degrees(value: float) -> str:
    """An angle with its unit."""
    return "no pose" if np.isinf(value) else f"{number(value)}°"


def number(value: float) -> str:
    """A number to about three digits; a dash where there is none."""
    if np.isnan(value):
        return "–"
    if np.isinf(value):
        return "∞" if value > 0 else "−∞"
    size = abs(value)
    digits = 3 if 0 < size < 0.01 else 2 if size < 10 else 1 if size < 100 else 0
    return f"{value:.{digits}f}".replace("-", "−")


def counted(count: int, noun: str) -> str:
    """A number and its noun: 1 sequence, 2 sequences."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def _medians(group: Group, scale: str) -> dict[str, float]:
    """Each method's median ADD-S [mm] at one noise scale, in the phase that counts most."""
    summary = group.rows(group.tables.summary, scale)
    rows = summary[(summary["object"] == ALL) & (summary["phase"] == group.phase)]
    return {
        str(name): float(mm)
        for name, mm in zip(rows["method"], rows["adds_median_mm"], strict=True)
    }


def _when(group: Group) -> str:
    words = phase_words(group.phase)
    return words[0].upper() + words[1:]


def _test_sentences(tests: Sequence[Mapping[Any, Any]], best: str) -> list[str]:
    """The best method against each of the others."""
    of_best = [test for test in tests if best in test["comparison"].split(" vs ")]
    if of_best and all(test["n"] < FEWEST for test in of_best):
        n, unit = of_best[0]["n"], of_best[0]["unit"]
        return [
            f"With {counted(n, unit)} nothing can be said about chance: at least {FEWEST} are needed."
        ]
    return [_sentence(test, best) for test in of_best]


def _sentence(test: Mapping[Any, Any], best: str) -> str:
    """One test, told from the side that it speaks for: pair by pair that need not be the best in the median."""
    first, second = test["comparison"].split(" vs ")
    other, sign = (second, 1.0) if first == best else (first, -1.0)
    if pd.isna(test["p"]):
        return f"{best} and {other}: {test['note']}."
    # Counted with the sign of the test, whose n_better belongs to its first-named method.
    rest = test["n"] - test["n_better"] - _equal(str(test["note"]))
    won, lost = (test["n_better"], rest) if sign > 0 else (rest, test["n_better"])
    of_all = f"of {counted(test['n'], test['unit'])}"
    chance = (
        f"p{_SPACE}={_SPACE}{p_value(test['p'])}, after Holm's correction {p_value(test['p_holm'])}"
    )
    if test["p_holm"] >= SIGNIFICANT and won >= lost:
        behind = f" and larger in {lost}" if lost else ""
        return f"{best} is smaller than {other} in {won} {of_all}{behind}, which could be chance ({chance})."
    if test["p_holm"] >= SIGNIFICANT:
        return f"Pair by pair {other} is smaller than {best} in {lost} {of_all}, which could be chance ({chance})."
    if sign * test["effect_size"] < 0:
        return f"Pair by pair, though, {other} is better than {best}: smaller in {lost} {of_all} ({chance})."
    gain = sign * test["difference_mm"]
    ends = sorted(sign * test[name] for name in ("difference_low_mm", "difference_high_mm"))
    interval = f" [{number(ends[0])}, {number(ends[1])}]" if not pd.isna(ends[0]) else ""
    return (
        f"{best} is better than {other}: smaller in {won} {of_all}, by {millimetres(gain)} in the median{interval} "
        f"({chance}; effect size {sign * test['effect_size']:.2f})."
    )


def _equal(note: str) -> int:
    """Number of equal pairs, which the note tells: "2 of 8 pairs equal, left out"."""
    words = note.split(" pairs equal")[0].split(" of ")
    return int(words[0]) if "pairs equal" in note and words[0].isdigit() else 0
