# SPDX-License-Identifier: MIT
"""Tables of the page: what is shown in a cell, and what it is sorted by."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pandas as pd

from .words import number, p_value


@dataclass(frozen=True)
class Cell:
    """What is read, and the key by which it is sorted; numbers by number, words by word."""

    text: str
    key: float | str


@dataclass(frozen=True)
class Head:
    """A column's title, and what it means."""

    text: str
    meaning: str = ""
    numeric: bool = True


@dataclass(frozen=True)
class Table:
    """A table of the page.

    Attributes:
        name: Its anchor.
        title: Its heading.
        note: What it shows.
        heads: Columns.
        rows: Cells by row.
    """

    name: str
    title: str
    note: str
    heads: list[Head]
    rows: list[list[Cell]]


LAST = 1e300  # sorts behind all numbers


def word(text: object) -> Cell:
    """A cell of words."""
    return Cell(str(text), str(text))


def value(x: float) -> Cell:
    """A cell of a number to three digits."""
    return Cell(number(x), _key(x))


def count(x: float) -> Cell:
    """A cell of a whole number."""
    return Cell(f"{int(x)}", float(x))


def percent(x: float) -> Cell:
    """A cell of a share, in percent."""
    return Cell("–" if pd.isna(x) else f"{100 * x:.1f}", _key(x))


def probability(x: float) -> Cell:
    """A cell of a p value."""
    return Cell("–" if pd.isna(x) else p_value(x), _key(x))


def interval(x: float, low: float, high: float) -> Cell:
    """A cell of a number with its interval."""
    ends = (
        ""
        if pd.isna(low)
        else f"\N{NO-BREAK SPACE}[{number(low)},\N{NO-BREAK SPACE}{number(high)}]"
    )
    return Cell(number(x) + ends, _key(x))


def _key(x: float) -> float:
    return LAST if pd.isna(x) or np.isinf(x) and x > 0 else float(x)
