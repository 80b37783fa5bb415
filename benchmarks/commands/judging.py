# SPDX-License-Identifier: MIT
"""The commands that judge estimates, on recordings whose truth is known."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

Recordings = Annotated[
    list[Path], typer.Argument(help="Folders of recordings with truth.", exists=True)
]
Jobs = Annotated[int, typer.Option(min=1, help="Processes to use.")]


def consistency(
    recordings: Annotated[
        Path, typer.Argument(help="Folder of recordings with truth.", exists=True)
    ],
) -> None:
    """Whether poses are as uncertain as their covariances say, the tracker's and the estimator's."""
    from ..consistency import run

    run(recordings)


def memory(
    recordings: Recordings,
    disturbed: Annotated[
        list[Path] | None,
        typer.Option(help="Those in which something goes wrong; else all.", exists=True),
    ] = None,
    jobs: Jobs = 2,
) -> None:
    """What memory gains before and after the turn, and where vision is silent, flipped, off or late."""
    from ..memory import run

    run(recordings, disturbed or recordings, jobs)


def memory_settings(
    recordings: Annotated[
        list[Path],
        typer.Argument(help="Folders of recordings that nothing is reported on.", exists=True),
    ],
    jobs: Jobs = 2,
) -> None:
    """Compare memory's settings with each of them halved and doubled."""
    from ..memory_settings import run

    run(recordings, jobs)


def images(recordings: Recordings, jobs: Jobs = 2) -> None:
    """What a tracker's images are worth beside touch, and how sure it is of itself."""
    from ..images import run

    run(recordings, jobs)


def hand_back(
    recordings: Annotated[
        list[Path],
        typer.Argument(help="Folders: grasps by a tracker, and the same by it +back.", exists=True),
    ],
    jobs: Jobs = 2,
) -> None:
    """What a tracker gains from being handed the fused pose where it has lost itself."""
    from ..hand_back import run

    run(recordings, jobs)


def faults(
    recordings: Annotated[
        list[Path], typer.Argument(help="Folders of recordings to spoil.", exists=True)
    ],
    clean: Annotated[
        list[Path] | None,
        typer.Option(help="Further folders, in which nothing should be named.", exists=True),
    ] = None,
    jobs: Jobs = 2,
) -> None:
    """Whether failing sensors are named, how soon, and what they do to the pose; false alarms."""
    from ..faults import run

    run(recordings, clean or [], jobs)


def events(
    objects: Annotated[
        str | None, typer.Option(help="Names separated by commas; else the built-in datasets' 17.")
    ] = None,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same grasps.")] = 5000,
) -> None:
    """Whether grasps, slips and drops are noticed, how soon, and how often where there are none."""
    from sim.objects import BUILT_IN

    from ..events import run

    run(objects.split(",") if objects else BUILT_IN, seed)


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
    jobs: Jobs = 2,
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
    from ..calibration import run

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


def claims(
    results: Annotated[list[str], typer.Argument(help="NAME=FOLDER of an evaluation, each.")],
) -> None:
    """The paper's claims about evaluations that are there: medians and p, a row a condition and phase."""
    from ..claims import run

    pairs = [result.partition("=") for result in results]
    for name, _, folder in pairs:
        if not (Path(folder) / "tests.csv").is_file():
            raise typer.BadParameter(
                f"expected NAME=FOLDER with a folder that vtgtsam evaluate wrote, got {name}={folder}"
            )
    run({name: Path(folder) for name, _, folder in pairs})


def tuning(
    recordings: Annotated[Path, typer.Argument(help="Folder of recordings.", exists=True)],
    trials: Annotated[int, typer.Option(min=2, help="Settings to try.")] = 40,
    jobs: Jobs = 2,
) -> None:
    """Search for the estimator's settings, on recordings that no result is reported on."""
    from ..tuning import run

    run(recordings, trials, jobs)


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
    friction: Annotated[
        str, typer.Option(help="dry, or paper: with that, held objects creep.")
    ] = "dry",
    jobs: Jobs = 2,
) -> None:
    """The paper's experiments, and what they are worth with a stereo camera on a robot that is off.

    Some hours in all; each condition, dataset and robot is a part, of minutes, and what is there is kept. Conditions
    that are asked for together are recorded from one simulation.
    """
    from sim.constants import FRICTION
    from sim.objects import object_names

    from ..experiments import CONDITIONS, Part, run

    chosen = conditions.split(",")
    unknown = [name for name in chosen if name not in CONDITIONS]
    if unknown:
        raise typer.BadParameter(
            f"expected some of {', '.join(CONDITIONS)}, got {', '.join(unknown)}",
            param_hint="--conditions",
        )
    if friction not in FRICTION:
        raise typer.BadParameter(
            f"expected {' or '.join(FRICTION)}, got {friction!r}", param_hint="--friction"
        )
    meshes = None if ycb is None else str(ycb.resolve())
    parts = [
        Part(condition, dataset, int(robot), meshes, friction)
        for condition in chosen
        for dataset in datasets.split(",")
        for robot in robots.split(",")
    ]
    run(parts, object_names(objects.split(",") if objects else None, ycb), out, jobs)
