# SPDX-License-Identifier: MIT
"""How far a long evaluation has come: a bar on a terminal, a line a sequence elsewhere."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..evaluation.sequence import Outcome

Progress = Callable[["Outcome", int], None]


@contextmanager
def show_progress() -> Iterator[Progress]:
    """Give a function that is told each outcome and the number of sequences; writes to stderr."""
    if sys.stderr.isatty():
        with _bar() as told:
            yield told
    else:
        yield _Lines()


@contextmanager
def _bar() -> Iterator[Progress]:
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        MofNCompleteColumn,
        Progress,
        TextColumn,
        TimeRemainingColumn,
    )

    columns = (TextColumn("evaluating"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, TextColumn("{task.description}"), console=Console(stderr=True)) as bar:
        task = bar.add_task("", total=None)

        def told(outcome: Outcome, total: int) -> None:
            bar.update(task, advance=1, total=total, description=outcome.sequence)

        yield told


class _Lines:
    def __init__(self) -> None:
        self.count = 0

    def __call__(self, outcome: Outcome, total: int) -> None:
        self.count += 1
        print(
            f"[{self.count}/{total}] {outcome.sequence}: {_word(outcome)}",
            file=sys.stderr,
            flush=True,
        )


def _word(outcome: Outcome) -> str:
    if outcome.problem:
        return f"failed: {outcome.problem}"
    frames = f"{outcome.about['frames']} frames"
    return f"{frames}, done before" if outcome.reused else frames
