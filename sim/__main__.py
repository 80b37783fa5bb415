# SPDX-License-Identifier: MIT
"""The simulator's command line: ``python -m sim generate | look``.

Exit codes: 0 done; 1 an error that is to be expected, in one line on stderr; 2 wrong usage; 3 finished,
but some sequences could not be made. Any other error is a mistake of this program and shows its traceback.
"""

from __future__ import annotations

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from vtgtsam.commands.edge import edge
from vtgtsam.commands.group import command_line
from vtgtsam.commands.options import Force, refuse_existing

if TYPE_CHECKING:
    from .datasets import Outcome

SOME_FAILED = 3
INTERRUPTED = 130  # 128 + SIGINT, as shells count

app = command_line("python -m sim")

Friction = Annotated[
    str,
    typer.Option(
        help="paper: MuJoCo's default, by which held objects creep; dry: a quarter as fast."
    ),
]


@app.callback()
def sim() -> None:
    """Simulated grasps of a robot hand, recorded with depth camera and tactile pads."""


@app.command()
def generate(
    dataset: Annotated[
        str, typer.Option(help="vary: any orientation, default place; occ: power grasps.")
    ],
    out: Annotated[Path, typer.Option(help="Folder to write to.")],
    objects: Annotated[
        str | None, typer.Option(help="Names separated by commas; else the dataset's 17.")
    ] = None,
    ycb: Annotated[
        Path | None,
        typer.Option(envvar="VTGTSAM_YCB", help="Directory of YCB meshes to use."),
    ] = None,
    grasps: Annotated[int, typer.Option(min=1, help="Sequences of each object.")] = 5,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same files.")] = 0,
    jobs: Annotated[int, typer.Option(min=1, help="Processes to use.")] = 1,
    noise: Annotated[
        str, typer.Option(help="Factors on the camera's noise, separated by commas.")
    ] = "1",
    tracker: Annotated[
        str,
        typer.Option(
            help="depth: knows nothing of the hand; depth-hand: knows its geometry; "
            "with +back: is handed the fused pose where it has lost itself; learnt-model: the truth with "
            "errors such as FoundationPose's (a model, not that tracker)."
        ),
    ] = "depth",
    camera: Annotated[
        str,
        typer.Option(
            help="paper: exact depth and the paper's noise; stereo: two infrared images, matched."
        ),
    ] = "paper",
    friction: Friction = "paper",
    hand: Annotated[
        str, typer.Option(help="Grasp description: isyhand, fourfinger or a YAML file.")
    ] = "isyhand",
    images: Annotated[
        bool, typer.Option("--images", help="Store depth and colour images too.")
    ] = False,
    calibration_error: Annotated[
        bool,
        typer.Option(
            "--calibration-error",
            help="Camera 2 mm and 1 degree off, joints 1 degree, depth failing at edges.",
        ),
    ] = False,
    registration_error: Annotated[
        bool,
        typer.Option(
            "--registration-error",
            help="The tracker starts 5 mm and 5 degrees beside the true pose.",
        ),
    ] = False,
    robot: Annotated[
        int | None,
        typer.Option(
            min=0,
            help="Number of the robot, whose calibration error all sequences then have, whatever their seed.",
        ),
    ] = None,
    event: Annotated[
        str | None,
        typer.Option(help="After the turn the object is pushed (slip), or the hand opens (drop)."),
    ] = None,
) -> None:
    """Make recordings of grasps. Interrupted, it goes on where it stopped when called again."""
    from .constants import FRICTION
    from .datasets import generate as make
    from .events import EVENTS
    from .objects import object_names
    from .progress import show_progress
    from .record import TRACKERS
    from .sampling import DATASETS
    from .sequence import CAMERA_NAMES, Settings

    if images:
        from .graphics import check_graphics

        check_graphics()  # before the work, not after it
    scales = _numbers(noise, "--noise")
    _check_choice(dataset, DATASETS, "--dataset")
    _check_choice(tracker, TRACKERS, "--tracker")
    if event is not None:
        _check_choice(event, EVENTS, "--event")
    _check_choice(camera, CAMERA_NAMES, "--camera")
    _check_choice(friction, tuple(FRICTION), "--friction")
    if camera == "stereo":
        from .stereo import check_opencv

        check_opencv()
    names = object_names(objects.split(",") if objects else None, ycb)
    settings = Settings(
        dataset=dataset,
        seed=seed,
        tracker=tracker,
        hand=hand,
        ycb=None if ycb is None else str(ycb.resolve()),
        images=images,
        calibration_error=calibration_error,
        robot=robot,
        event=event,
        camera=camera,
        friction=friction,
        registration_error=registration_error,
    )
    try:
        with show_progress() as progress:
            outcomes = make(settings, names, grasps, scales, out, jobs, progress)
    except KeyboardInterrupt:
        typer.echo("sim: interrupted; the same call goes on where it stopped", err=True)
        raise typer.Exit(INTERRUPTED) from None
    failed = _print_summary(outcomes, out / dataset)
    if failed:
        raise typer.Exit(SOME_FAILED)


@app.command()
def look(
    recording: Annotated[
        Path, typer.Argument(help="A recording, of this simulator or a real hand.")
    ],
    out: Annotated[
        Path, typer.Option(help="File to write: .mp4, .gif, .webp, or .png for a sheet.")
    ],
    size: Annotated[str, typer.Option(help="Width and height of one view [pixels].")] = "480x360",
    stacked: Annotated[
        bool, typer.Option("--stacked", help="In a film, the camera's view above the side's.")
    ] = False,
    instants: Annotated[
        int, typer.Option(min=1, max=20, help="Pictures side by side in a sheet.")
    ] = 4,
    fps: Annotated[
        float | None,
        typer.Option(min=1, max=60, help="Pictures in a second. [default: mp4 30, others 10]"),
    ] = None,
    speed: Annotated[
        float, typer.Option(min=0.05, max=50, help="Seconds of the recording in one of the film.")
    ] = 1.0,
    estimates: Annotated[
        Path | None,
        typer.Option(help="Folder that `vtgtsam evaluate` wrote; its poses are drawn too."),
    ] = None,
    methods: Annotated[
        str,
        typer.Option(
            help="Methods whose poses are drawn, separated by commas; NAME=METHOD gives one another name."
        ),
    ] = "vis,vis+tac+pen",
    force: Force = False,
) -> None:
    """Draw a recording from the camera and from the side, pads in contact lit up.

    Needs OpenGL, by EGL or OSMesa, but no display.
    """
    from .look import write_film, write_sheet
    from .look.film import FPS
    from .look.instants import read_estimates

    suffix = out.suffix.lower()
    if suffix not in (".png", *FPS):
        raise typer.BadParameter(
            f"expected a .mp4, .gif, .webp or .png file, got {out.name!r}", param_hint="--out"
        )
    refuse_existing(out, force, recording)
    shape = _size(size)
    shown = {}
    if estimates is not None:
        for words in methods.split(","):
            name, _, method = words.strip().rpartition("=")
            shown[name or method] = read_estimates(estimates, recording, method)
    if suffix == ".png":
        write_sheet(recording, out, instants, shape, shown)
    else:
        write_film(recording, out, fps, speed, shape, stacked, shown)
    typer.echo(f"wrote {out}, {out.stat().st_size / 1e6:.2f} MB")


@app.command()
def contacts(
    dataset: Annotated[str, typer.Option(help="vary or occ.")] = "vary",
    objects: Annotated[
        str | None, typer.Option(help="Names separated by commas; else the dataset's 17.")
    ] = None,
    ycb: Annotated[
        Path | None,
        typer.Option(envvar="VTGTSAM_YCB", help="Directory of YCB meshes to use."),
    ] = None,
    seed: Annotated[int, typer.Option(min=0)] = 0,
    hand: Annotated[
        str, typer.Option(help="Grasp description: isyhand, fourfinger or a YAML file.")
    ] = ("isyhand"),
    friction: Friction = "paper",
) -> None:
    """How true contacts are: convex parts against the mesh, overlap of pads and object, and how objects creep."""
    from .constants import FRICTION
    from .contacts import table
    from .objects import object_names
    from .sampling import DATASETS
    from .sequence import Settings

    _check_choice(dataset, DATASETS, "--dataset")
    _check_choice(friction, tuple(FRICTION), "--friction")
    names = object_names(objects.split(",") if objects else None, ycb)
    folder = None if ycb is None else str(ycb.resolve())
    settings = Settings(dataset, seed=seed, hand=hand, ycb=folder, friction=friction)
    for line in table(settings, names):
        typer.echo(line)


def _size(text: str) -> tuple[int, int]:
    width, _, height = text.partition("x")
    if width.isdecimal() and height.isdecimal():
        if all(32 <= n <= 4096 for n in (int(width), int(height))):
            return int(width), int(height)
    raise typer.BadParameter(
        f"expected WIDTHxHEIGHT, 32 to 4096 each, got {text!r}", param_hint="--size"
    )


def _numbers(text: str, option: str) -> list[float]:
    try:
        numbers = [float(word) for word in text.split(",")]
    except ValueError:
        numbers = []
    if not numbers or not all(0 <= number < float("inf") for number in numbers):
        raise typer.BadParameter(
            f"expected numbers of 0 or more, like 1 or 0.5,1,2, got {text!r}", param_hint=option
        )
    if len(set(numbers)) < len(numbers):
        raise typer.BadParameter(f"a number occurs twice in {text!r}", param_hint=option)
    return numbers


def _check_choice(value: str, choices: tuple[str, ...], option: str) -> None:
    if value not in choices:
        raise typer.BadParameter(
            f"expected {' or '.join(choices)}, got {value!r}", param_hint=option
        )


def _print_summary(outcomes: list[Outcome], folder: Path) -> bool:
    """Say what was made and rejected, and whether anything failed."""
    from .datasets import REJECTED

    failed = [outcome for outcome in outcomes if outcome.problem]
    rejections = sum((outcome.rejections for outcome in outcomes), Counter())
    made = len(outcomes) - len(failed)
    typer.echo(f"{made} of {len(outcomes)} sequences are in {folder}")
    typer.echo(f"{rejections.total()} samples were rejected; {folder / REJECTED} lists them")
    for reason, count in rejections.most_common():
        typer.echo(f"  {count:5d} {reason}")
    for outcome in failed:
        typer.echo(f"failed: {outcome.name}: {outcome.problem}", err=True)
    return bool(failed)


def main() -> None:
    """Run the command line of this process."""
    with edge("sim"):
        app()


if __name__ == "__main__":
    main()
