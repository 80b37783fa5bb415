# SPDX-License-Identifier: MIT
"""The commands that measure how fast the parts are, and how exact."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, get_args

import typer


def speed(
    frames: Annotated[int, typer.Option(min=20, help="Frames a solver and problem.")] = 300,
    recording: Annotated[
        Path | None, typer.Option(help="A recorded sequence to time as well.", exists=True)
    ] = None,
) -> None:
    """Time a frame, taking turns with Theseus on the same core."""
    from ..speed import run

    run(frames, recording)


def accuracy(
    frames: Annotated[int, typer.Option(min=20, help="Frames a sequence.")] = 100,
) -> None:
    """Compare the solvers with an independent implementation, and their errors with their times."""
    from ..accuracy import run

    run(frames)


def scaling(
    frames: Annotated[int, typer.Option(min=20, help="Frames a solver and problem.")] = 40,
) -> None:
    """Vary pads, points, grid resolution and iterations."""
    from ..scaling import run

    run(frames)


def breakdown(
    frames: Annotated[int, typer.Option(min=20, help="Frames a problem.")] = 100,
) -> None:
    """Where a frame's time goes: GTSAM, callbacks, the search, the rest."""
    from ..breakdown import run

    run(frames)


def exactness(
    stored: Annotated[Path, typer.Argument(help="File of starts and poses, .npz.")],
    recordings: Annotated[
        Path | None, typer.Option(help="Recordings to solve as well.", exists=True)
    ] = None,
) -> None:
    """Store each frame's start and pose, or compare with what an earlier version stored."""
    from ..exactness import run

    run(stored, recordings)


def soak(
    frames: Annotated[int, typer.Option(min=100, help="Frames in one process.")] = 100_000,
    solver: Annotated[str, typer.Option(help="lm or fixed-damping.")] = "lm",
) -> None:
    """Run long, and watch memory and time."""
    from vtgtsam.config import Solver

    from ..soak import run

    if solver not in get_args(Solver):
        expected = " or ".join(get_args(Solver))
        raise typer.BadParameter(f"expected {expected}, got {solver}", param_hint="--solver")
    run(frames, solver)


def remembering(
    recording: Annotated[Path, typer.Argument(help="A recording with truth.", exists=True)],
    frames: Annotated[int, typer.Option(min=100, help="Frames in one process.")] = 100_000,
) -> None:
    """Time frames with memory next to ones without, and watch the process's size."""
    from ..remembering import run

    run(recording, frames)


def live(
    recording: Annotated[
        Path, typer.Argument(help="A recording, played in real time.", exists=True)
    ],
    late: Annotated[float, typer.Option(min=0.0, help="How late vision comes [s].")] = 0.08,
    rate: Annotated[float, typer.Option(min=1.0, help="Frames a second [Hz].")] = 30.0,
) -> None:
    """Time the live loop from the last message to the pose."""
    from ..live import run

    run(recording, late, rate)


def tracker() -> None:
    """Time the visual tracker's images, with either camera, with and without the hand's geometry."""
    from ..tracker import run

    run()


def startup() -> None:
    """Time a process up to its first estimate, with empty caches and with full ones."""
    from ..startup import run

    run()


def evaluation(
    recordings: Annotated[
        Path | None, typer.Option(help="Recordings; simulated where not given.", exists=True)
    ] = None,
    folders: Annotated[
        bool, typer.Option(help="Whole folders too, by the clock: on a machine without other work.")
    ] = True,
) -> None:
    """Time the evaluation of recordings: parts of a sequence, folders, two processes."""
    from ..evaluation import run

    run(recordings, folders)


def field(
    largest: Annotated[
        int, typer.Option(min=32, help="Nodes a side of the finest grid, up to 512.")
    ] = 256,
) -> None:
    """Time distance fields, built and from the cache, and compare them with exact distances."""
    from ..field import run

    run(largest)
