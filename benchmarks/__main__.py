# SPDX-License-Identifier: MIT
"""The benchmarks' command line, ``python -m benchmarks``."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

os.environ.setdefault(
    "OMP_NUM_THREADS", "1"
)  # before NumPy is loaded: everything here is one thread

import typer

from vtgtsam.commands.group import command_line

app = command_line("python -m benchmarks")


@app.command()
def speed(
    frames: Annotated[int, typer.Option(min=20, help="Frames a solver and problem.")] = 300,
    recording: Annotated[
        Path | None, typer.Option(help="A recorded sequence to time as well.", exists=True)
    ] = None,
) -> None:
    """Time a frame, taking turns with Theseus on the same core."""
    from .speed import run

    run(frames, recording)


@app.command()
def accuracy(
    frames: Annotated[int, typer.Option(min=20, help="Frames a sequence.")] = 100,
) -> None:
    """Compare the solvers with an independent implementation, and their errors with their times."""
    from .accuracy import run

    run(frames)


@app.command()
def scaling(
    frames: Annotated[int, typer.Option(min=20, help="Frames a solver and problem.")] = 40,
) -> None:
    """Vary pads, points, grid resolution and iterations."""
    from .scaling import run

    run(frames)


@app.command()
def consistency(
    recordings: Annotated[
        Path, typer.Argument(help="Folder of recordings with truth.", exists=True)
    ],
) -> None:
    """Whether poses are as uncertain as their covariances say, the tracker's and the estimator's."""
    from .consistency import run

    run(recordings)


@app.command()
def memory(
    recordings: Annotated[
        list[Path], typer.Argument(help="Folders of recordings with truth.", exists=True)
    ],
    disturbed: Annotated[
        list[Path] | None,
        typer.Option(help="Those in which something goes wrong; else all.", exists=True),
    ] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Processes to use.")] = 2,
) -> None:
    """What memory gains before and after the turn, and where vision is silent, flipped, off or late."""
    from .memory import run

    run(recordings, disturbed or recordings, jobs)


@app.command(name="memory-settings")
def memory_settings(
    recordings: Annotated[
        list[Path],
        typer.Argument(help="Folders of recordings that nothing is reported on.", exists=True),
    ],
    jobs: Annotated[int, typer.Option(min=1, help="Processes to use.")] = 2,
) -> None:
    """Compare memory's settings with each of them halved and doubled."""
    from .memory_settings import run

    run(recordings, jobs)


@app.command()
def images(
    recordings: Annotated[
        list[Path], typer.Argument(help="Folders of recordings with truth.", exists=True)
    ],
    jobs: Annotated[int, typer.Option(min=1, help="Processes to use.")] = 2,
) -> None:
    """What a tracker's images are worth beside touch, and how sure it is of itself."""
    from .images import run

    run(recordings, jobs)


@app.command()
def tracker() -> None:
    """Time the visual tracker's images, with either camera, with and without the hand's geometry."""
    from .tracker import run

    run()


@app.command(name="hand-back")
def hand_back(
    recordings: Annotated[
        list[Path],
        typer.Argument(help="Folders: grasps by a tracker, and the same by it +back.", exists=True),
    ],
    jobs: Annotated[int, typer.Option(min=1, help="Processes to use.")] = 2,
) -> None:
    """What a tracker gains from being handed the fused pose where it has lost itself."""
    from .hand_back import run

    run(recordings, jobs)


@app.command()
def faults(
    recordings: Annotated[
        list[Path], typer.Argument(help="Folders of recordings to spoil.", exists=True)
    ],
    clean: Annotated[
        list[Path] | None,
        typer.Option(help="Further folders, in which nothing should be named.", exists=True),
    ] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Processes to use.")] = 2,
) -> None:
    """Whether failing sensors are named, how soon, and what they do to the pose; false alarms."""
    from .faults import run

    run(recordings, clean or [], jobs)


@app.command()
def events(
    objects: Annotated[
        str | None, typer.Option(help="Names separated by commas; else the built-in datasets' 17.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same grasps.")] = 5000,
) -> None:
    """Whether grasps, slips and drops are noticed, how soon, and how often where there are none."""
    from sim.objects import BUILT_IN

    from .events import run

    run(objects.split(",") if objects else BUILT_IN, seed)


@app.command()
def calibration(
    recordings: Annotated[
        Path, typer.Argument(help="Folder of simulated recordings with truth.", exists=True)
    ],
    robots: Annotated[int, typer.Option(min=1, help="Robots, each with errors of its own.")] = 12,
    tests: Annotated[int, typer.Option(min=1, help="Grasps that each is judged on.")] = 4,
    grasps: Annotated[
        str, typer.Option(help="Numbers of earlier grasps, separated by commas.")
    ] = "0,1,2,5,10",
    methods: Annotated[
        str, typer.Option(help="Methods, separated by commas.")
    ] = "vis,vis+tac+pen,vis+tac+pen+mem",
    plain: Annotated[
        str, typer.Option(help="Methods to judge without a calibration alone, besides.")
    ] = "",
    jobs: Annotated[int, typer.Option(min=1, help="Processes to use.")] = 2,
    recorded: Annotated[
        bool,
        typer.Option(
            "--recorded",
            help="Judge the robots that made the recordings (sim generate --robot), whatever the tracker.",
        ),
    ] = False,
    online: Annotated[
        bool, typer.Option(help="Judge calibrating while it works, too: much of the time.")
    ] = True,
    tracker_off: Annotated[
        float,
        typer.Option(
            min=0.0, help="By how much the tracker is off on each object, otherwise [mm]."
        ),
    ] = 0.0,
) -> None:
    """What a robot gains from calibrating itself, by the number of its earlier grasps."""
    from .calibration import run

    counts = [int(count) for count in grasps.split(",")]
    run(
        recordings,
        robots,
        tests,
        counts,
        methods.split(","),
        plain.split(",") if plain else [],
        jobs,
        recorded,
        online,
        tracker_off / 1e3,
    )


@app.command()
def claims(
    results: Annotated[list[str], typer.Argument(help="NAME=FOLDER of an evaluation, each.")],
) -> None:
    """The paper's claims about evaluations that are there: medians and p, a row a condition and phase."""
    from .claims import run

    pairs = [result.partition("=") for result in results]
    for name, _, folder in pairs:
        if not (Path(folder) / "tests.csv").is_file():
            raise typer.BadParameter(
                f"expected NAME=FOLDER with a folder that vtgtsam evaluate wrote, got {name}={folder}"
            )
    run({name: Path(folder) for name, _, folder in pairs})


@app.command()
def tuning(
    recordings: Annotated[Path, typer.Argument(help="Folder of recordings.", exists=True)],
    trials: Annotated[int, typer.Option(min=2, help="Settings to try.")] = 40,
    jobs: Annotated[int, typer.Option(min=1, help="Processes to use.")] = 2,
) -> None:
    """Search for the estimator's settings, on recordings that no result is reported on."""
    from .tuning import run

    run(recordings, trials, jobs)


@app.command()
def breakdown(
    frames: Annotated[int, typer.Option(min=20, help="Frames a problem.")] = 100,
) -> None:
    """Where a frame's time goes: GTSAM, callbacks, the search, the rest."""
    from .breakdown import run

    run(frames)


@app.command()
def soak(
    frames: Annotated[int, typer.Option(min=100, help="Frames in one process.")] = 100_000,
    solver: Annotated[str, typer.Option(help="lm or fixed-damping.")] = "lm",
) -> None:
    """Run long, and watch memory and time."""
    from .soak import run

    run(frames, solver)


@app.command()
def live(
    recording: Annotated[
        Path, typer.Argument(help="A recording, played in real time.", exists=True)
    ],
    late: Annotated[float, typer.Option(min=0.0, help="How late vision comes [s].")] = 0.08,
    rate: Annotated[float, typer.Option(min=1.0, help="Frames a second [Hz].")] = 30.0,
) -> None:
    """Time the live loop from the last message to the pose."""
    from .live import run

    run(recording, late, rate)


@app.command()
def remembering(
    recording: Annotated[Path, typer.Argument(help="A recording with truth.", exists=True)],
    frames: Annotated[int, typer.Option(min=100, help="Frames in one process.")] = 100_000,
) -> None:
    """Time frames with memory next to ones without, and watch the process's size."""
    from .remembering import run

    run(recording, frames)


@app.command()
def startup() -> None:
    """Time a process up to its first estimate, with empty caches and with full ones."""
    from .startup import run

    run()


@app.command()
def evaluation(
    recordings: Annotated[
        Path | None, typer.Option(help="Recordings; simulated where not given.", exists=True)
    ] = None,
    folders: Annotated[
        bool, typer.Option(help="Whole folders too, by the clock: on a machine without other work.")
    ] = True,
) -> None:
    """Time the evaluation of recordings: parts of a sequence, folders, two processes."""
    from .evaluation import run

    run(recordings, folders)


@app.command()
def field(
    largest: Annotated[
        int, typer.Option(min=32, help="Nodes a side of the finest grid, up to 512.")
    ] = 256,
) -> None:
    """Time distance fields, built and from the cache, and compare them with exact distances."""
    from .field import run

    run(largest)


@app.command()
def exactness(
    stored: Annotated[Path, typer.Argument(help="File of starts and poses, .npz.")],
    recordings: Annotated[
        Path | None, typer.Option(help="Recordings to solve as well.", exists=True)
    ] = None,
) -> None:
    """Store each frame's start and pose, or compare with what an earlier version stored."""
    from .exactness import run

    run(stored, recordings)


@app.command()
def experiments(
    out: Annotated[
        Path, typer.Option(help="Folder for recordings and evaluations (0.1 GB a part).")
    ],
    conditions: Annotated[
        str, typer.Option(help="Separated by commas.")
    ] = "paper,paper-robot,stereo,stereo-robot",
    datasets: Annotated[str, typer.Option(help="Separated by commas.")] = "vary,occ",
    robots: Annotated[str, typer.Option(help="Numbers, separated by commas.")] = "0,1,2,3,4",
    objects: Annotated[
        str | None, typer.Option(help="Names separated by commas; else the datasets' 17.")
    ] = None,
    ycb: Annotated[
        Path | None,
        typer.Option(envvar="VTGTSAM_YCB", help="Directory of YCB meshes to use."),
    ] = None,
    jobs: Annotated[int, typer.Option(min=1, help="Processes to use.")] = 2,
) -> None:
    """The paper's experiments, and what they are worth with a stereo camera on a robot that is off.

    Some hours in all; each condition, dataset and robot is a part, of minutes, and what is there is kept. Conditions
    that are asked for together are recorded from one simulation.
    """
    from sim.objects import object_names

    from .experiments import CONDITIONS, Part, run

    chosen = conditions.split(",")
    unknown = [name for name in chosen if name not in CONDITIONS]
    if unknown:
        raise typer.BadParameter(
            f"expected some of {', '.join(CONDITIONS)}, got {', '.join(unknown)}",
            param_hint="--conditions",
        )
    meshes = None if ycb is None else str(ycb.resolve())
    parts = [
        Part(condition, dataset, int(robot), meshes)
        for condition in chosen
        for dataset in datasets.split(",")
        for robot in robots.split(",")
    ]
    run(parts, object_names(objects.split(",") if objects else None, ycb), out, jobs)


@app.callback()
def benchmarks() -> None:
    """How fast and how exact the estimator is. Each command writes into benchmarks/results/."""


if __name__ == "__main__":
    app(prog_name="python -m benchmarks")
