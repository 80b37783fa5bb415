# SPDX-License-Identifier: MIT
"""Figures of an evaluation, drawn with Matplotlib into files; no window, no display.

Each file draws one kind of figure from the run's tables; ``style`` says how all of them look.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import matplotlib

from .. import folder, store
from ..groups import Group, groups
from ..tables import Tables
from .contacts import contacts_figure
from .coverage import coverage_figure
from .drawing import Drawing, Picture, save
from .methods import methods_figure
from .noise import noise_figure, noise_phases
from .objects import objects_figure, panels_figure, worst_objects
from .over_time import time_figure
from .pose_errors import pose_errors_figure
from .style import STYLE
from .worst import worst_figure, worst_sequences


@dataclass(frozen=True)
class Chapter:
    """The finished figures of one dataset and tracker: over all its sequences, and of the worst ones."""

    group: Group
    overview: list[Picture]
    worst: list[Picture]


def make_figures(out: Path, tables: Tables) -> list[Chapter]:
    """Draw all figures anew into ``figures/*.png`` of the run's folder."""
    folder.release_below(out, store.FIGURES)
    with matplotlib.rc_context(STYLE):  # type: ignore[arg-type]
        return [
            Chapter(
                group,
                [_saved(drawing, out) for drawing in _overview(group, out)],
                [_saved(drawing, out) for drawing in _worst(group, out)],
            )
            for group in groups(tables)
        ]


def _saved(drawing: Drawing, out: Path) -> Picture:
    name = f"{store.FIGURES}/{drawing.name}.png"
    folder.claim(out, [name])
    return save(drawing, out / name)


def _overview(group: Group, out: Path) -> Iterator[Drawing]:
    several = len(worst_objects(group)) > 1
    yield methods_figure(group)
    yield time_figure(group)
    if several:
        yield objects_figure(group)
    yield from filter(None, [coverage_figure(group)])
    yield pose_errors_figure(group)
    for phase in noise_phases(group):
        yield noise_figure(group, phase)
    if several:
        yield panels_figure(group)
    yield from filter(None, [contacts_figure(group, out)])


def _worst(group: Group, out: Path) -> Iterator[Drawing]:
    for place, sequence in enumerate(worst_sequences(group), start=1):
        yield worst_figure(group, out, sequence, place)
