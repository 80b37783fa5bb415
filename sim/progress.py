# SPDX-License-Identifier: MIT
"""How far a dataset has come: bars on a terminal, plain lines elsewhere."""

from __future__ import annotations

import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager

from .datasets import Progress


@contextmanager
def show_progress() -> Iterator[Progress]:
    """Give a function that is told how far the work has come; it writes to stderr."""
    if sys.stderr.isatty():
        with _bars() as told:
            yield told
    else:
        yield _lines()


@contextmanager
def _bars() -> Iterator[Progress]:
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bars

    left = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn())
    right = (TimeRemainingColumn(), TextColumn("{task.fields[text]}"))
    with Bars(*left, *right, console=Console(stderr=True)) as bars:
        tasks = {}

        def told(stage: str, done: int, total: int, text: str) -> None:
            if stage not in tasks:
                tasks[stage] = bars.add_task(stage, total=total, text="")
            bars.update(tasks[stage], completed=done, text=text)

        yield told


def _lines() -> Progress:
    start = time.monotonic()

    def told(stage: str, done: int, total: int, text: str) -> None:
        seconds = time.monotonic() - start
        print(f"{seconds:5.0f} s  {stage} {done}/{total}  {text}", file=sys.stderr, flush=True)

    return told
