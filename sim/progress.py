# SPDX-License-Identifier: MIT
"""How far a dataset has come: a bar on a terminal, a line a sequence elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from .datasets import Outcome, Progress


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
        TextColumn,
        TimeRemainingColumn,
    )
    from rich.progress import Progress as Bar

    columns = (TextColumn("simulating"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Bar(*columns, TextColumn("{task.description}"), console=Console(stderr=True)) as bar:
        task = bar.add_task("preparing the objects", total=None)

        def told(outcome: Outcome, total: int) -> None:
            bar.update(task, advance=1, total=total, description=str(outcome.name))

        yield told


class _Lines:
    def __init__(self) -> None:
        self._count = 0
        self._start = time.monotonic()
        print("preparing the objects", file=sys.stderr, flush=True)

    def __call__(self, outcome: Outcome, total: int) -> None:
        self._count += 1
        seconds = time.monotonic() - self._start
        print(
            f"[{self._count}/{total}] {outcome.name}: {describe(outcome)} ({seconds:.0f} s)",
            file=sys.stderr,
            flush=True,
        )


def describe(outcome: Outcome) -> str:
    """An outcome in words."""
    if outcome.problem:
        return f"failed: {outcome.problem}"
    rejected = outcome.rejections.total()
    word = "done before" if outcome.reused else "done"
    return f"{word}, {rejected} samples rejected before" if rejected else word
