# SPDX-License-Identifier: MIT
"""Recordings of one dataset and one tracker: what one chapter of the report is about."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import pandas as pd

from .phases import AFTER
from .statistics import ALL
from .tables import Tables

_NOMINAL = "1"  # noise scale whose noise is the sensors' own


@dataclass(frozen=True)
class Group:
    """One chapter.

    Attributes:
        dataset: Name of the dataset, empty where the recordings name none.
        tracker: Name of the visual tracker, empty where the recordings name none.
        scales: Noise scales, from small to large.
        tables: The run's tables.
    """

    dataset: str
    tracker: str
    scales: tuple[str, ...]
    tables: Tables

    @property
    def scale(self) -> str:
        """The noise scale that is shown in detail."""
        return _NOMINAL if _NOMINAL in self.scales else self.scales[0]

    @property
    def methods(self) -> list[str]:
        """Names of the methods, in the order in which they were given."""
        return self.tables.collected.methods

    @property
    def phase(self) -> str:
        """The phase that counts most: after the turn where there was one, else all of it."""
        phases = self.rows(self.tables.collected.phases)["phase"]
        return AFTER if (phases == AFTER).any() else ALL

    def rows(self, table: pd.DataFrame, scale: str | None = None) -> pd.DataFrame:
        """This group's rows of a table, at the noise scale shown in detail or at another."""
        wanted = self.scale if scale is None else scale
        return table[self._all(table) & (table["noise_scale"] == wanted)]

    def at_all_scales(self, table: pd.DataFrame) -> pd.DataFrame:
        """This group's rows of a table."""
        return table[self._all(table)]

    def _all(self, table: pd.DataFrame) -> pd.Series:
        return (table["dataset"] == self.dataset) & (table["tracker"] == self.tracker)

    @property
    def title(self) -> str:
        """Dataset and tracker in words."""
        parts = [f"dataset {self.dataset}" if self.dataset else ""]
        parts.append(f"tracker {self.tracker}" if self.tracker else "")
        words = ", ".join(filter(None, parts)) or "all recordings"
        return words[0].upper() + words[1:]

    @property
    def slug(self) -> str:
        """Dataset and tracker as the beginning of a file's name."""
        name = "_".join(filter(None, (self.dataset, self.tracker))) or "all"
        plain = "".join(c if c.isalnum() or c in "_-+." else "-" for c in name)
        return plain.lstrip("-.") or "all"


def groups(tables: Tables) -> Iterator[Group]:
    """All chapters, sorted by dataset and tracker; recordings without known errors have none."""
    phases = tables.collected.phases
    for (dataset, tracker), rows in phases.groupby(["dataset", "tracker"], sort=True):
        scales = tuple(sorted(rows["noise_scale"].unique(), key=_number))
        yield Group(str(dataset), str(tracker), scales, tables)


def phase_name(phase: str) -> str:
    """A phase by its name: "whole sequence", "before the turn"."""
    return "whole sequence" if phase == ALL else f"{phase} the turn"


def phase_words(phase: str) -> str:
    """A phase as a sentence says it: "over the whole sequence", "before the turn"."""
    return f"over the {phase_name(phase)}" if phase == ALL else phase_name(phase)


def _number(scale: str) -> tuple[float, str]:
    try:
        return float(scale), scale
    except ValueError:
        return float("inf"), scale
