# SPDX-License-Identifier: MIT
"""Figures of an evaluation, drawn with Matplotlib into files; no window, no display.

Each file draws one kind of figure from the run's tables; ``style`` says how all of them look.
"""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import matplotlib

from .. import store
from ..groups import Group, groups
from ..tables import Tables
from .contacts import contacts_figure
from .drawing import Drawing, Picture, save
from .methods import methods_figure
from .noise import noise_figure, noise_phases
from .objects import objects_figure, panels_figure, worst_objects
from .over_time import time_figure
from .style import STYLE
from .worst import worst_figure, worst_sequences


@dataclass(frozen=True)
class Chapter:
    """The finished figures of one dataset and tracker."""

    group: Group
    overview: list[Picture]
    objects: list[Picture]
    contacts: list[Picture]
    worst: list[Picture]


def make_figures(out: Path, tables: Tables) -> list[Chapter]:
    """Draw all figures anew into ``figures/*.png`` of the run's folder."""
    folder = out / store.FIGURES
    shutil.rmtree(folder, ignore_errors=True)
    with matplotlib.rc_context(STYLE):  # type: ignore[arg-type]
        return [_chapter(out, folder, group) for group in groups(tables)]


def _chapter(out: Path, folder: Path, group: Group) -> Chapter:
    def saved(drawings: Iterator[Drawing]) -> list[Picture]:
        return [save(drawing, folder) for drawing in drawings]

    return Chapter(
        group,
        saved(_overview(group)),
        saved(_objects(group)),
        saved(filter(None, iter([contacts_figure(group, out)]))),
        saved(
            worst_figure(group, out, sequence, place)
            for place, sequence in enumerate(worst_sequences(group), start=1)
        ),
    )


def _overview(group: Group) -> Iterator[Drawing]:
    yield methods_figure(group)
    yield time_figure(group)
    for phase in noise_phases(group):
        yield noise_figure(group, phase)


def _objects(group: Group) -> Iterator[Drawing]:
    if len(worst_objects(group)) > 1:
        yield objects_figure(group)
        yield panels_figure(group)
