# SPDX-License-Identifier: MIT
"""The benchmarks' command line: ``python -m benchmarks speed``."""

from __future__ import annotations

import os
from typing import Annotated

os.environ.setdefault(
    "OMP_NUM_THREADS", "1"
)  # before NumPy is loaded: two threads on a busy machine are slower

import typer

app = typer.Typer(no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False)

Frames = Annotated[int, typer.Option(min=20, help="Frames a solver and problem.")]


@app.command()
def speed(frames: Frames = 300) -> None:
    """Time a frame, alternating with Theseus on the same core."""
    from . import speed

    speed.run(frames)


@app.callback()
def benchmarks() -> None:
    """How fast and how exact the estimator is. Each command writes into benchmarks/results/."""


if __name__ == "__main__":
    app(prog_name="python -m benchmarks")
