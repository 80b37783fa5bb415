# SPDX-License-Identifier: MIT
"""``vtgtsam evaluate``: methods on recorded sequences."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from ..config import EstimatorConfig

from .options import (
    Calibration,
    Hand,
    Object,
    ObjectResolution,
    ObjectSymmetry,
    Topics,
    object_given,
)

SOME_FAILED = 3
INTERRUPTED = 130  # 128 + SIGINT, as shells count


def evaluate(
    paths: Annotated[
        list[str],
        typer.Argument(
            metavar="PATHS",
            help=".mcap files, rosbag2 folders, or folders that are searched for both; or their URLs "
            "(s3://bucket/folder, gs://...), fetched one sequence at a time.",
        ),
    ],
    out: Annotated[
        str,
        typer.Option(
            metavar="PATH",
            help="Folder for everything that is computed, on this machine or one that all workers share.",
        ),
    ],
    methods: Annotated[
        str | None,
        typer.Option(
            help="Methods to compare, separated by commas. "
            "[default: vis,vis+pen,vis+tac+pen,vis+tac+pen+mem; the first three with the paper's presets]"
        ),
    ] = None,
    config: Annotated[
        str, typer.Option(help="Preset (simulation, real_world, tuned) or YAML file.")
    ] = "tuned",
    jobs: Annotated[int, typer.Option(min=1, help="Processes to use.")] = 1,
    scheduler: Annotated[
        str | None, typer.Option(help="Dask scheduler to use instead, tcp://HOST:PORT.")
    ] = None,
    topics: Topics = None,
    hand: Hand = None,
    object: Object = None,
    resolution: ObjectResolution = None,
    symmetry: ObjectSymmetry = None,
    calibration: Calibration = None,
    force: Annotated[
        bool,
        typer.Option(
            "--force",
            help="Use a folder that holds other files as well; what vtgtsam did not make stays as it is.",
        ),
    ] = False,
) -> None:
    """Estimate the object's pose in recordings and compare with the truth.

    Interrupted, it goes on where it stopped when called again.
    """
    from ..extras import require

    require("evaluate", "an evaluation needs", "pandas", "pyarrow", "joblib", "threadpoolctl")
    from ..evaluation.folder import in_use
    from ..evaluation.methods import check_methods, default_methods, load_config
    from ..evaluation.printing import tables_text
    from ..evaluation.run import run
    from .progress import show_progress
    from .report import write_report

    names = default_methods(config)
    if methods is not None:
        names = [name.strip() for name in methods.split(",")]
    try:
        check_methods(names)
    except ValueError as error:
        raise typer.BadParameter(str(error), param_hint="--methods") from None
    _say_what_differs(load_config(config))
    try:
        with show_progress() as progress:
            tables = run(
                paths,
                names,
                config,
                out,
                jobs,
                scheduler,
                hand,
                object_given(object, resolution, symmetry),
                topics,
                force,
                progress=progress,
                calibration=calibration,
            )
    except KeyboardInterrupt:
        typer.echo("vtgtsam: interrupted; the same call goes on where it stopped", err=True)
        raise typer.Exit(INTERRUPTED) from None
    if len(tables.failed) < len(tables.sequences):
        typer.echo(tables_text(tables))
        with in_use(Path(out)):
            write_report(Path(out), tables)
    if tables.failed:
        typer.echo(f"\n{len(tables.failed)} of {len(tables.sequences)} sequences failed:", err=True)
        for sequence, problem in tables.failed.items():
            typer.echo(f"  {sequence}: {problem}", err=True)
        raise typer.Exit(SOME_FAILED)


def _say_what_differs(config: EstimatorConfig) -> None:
    """Print the settings that are not the recommended ones; the method is the one that each row names."""
    settings = config.differences()
    settings.pop("method", None)
    if settings:
        words = ", ".join(f"{name} = {_value(value)}" for name, value in settings.items())
        typer.echo(f"Other than recommended: {words}\n")


def _value(value: Any) -> str:
    if isinstance(value, tuple):
        return f"({', '.join(map(_value, value))})"
    return f"{value:g}" if isinstance(value, float) else str(value)
