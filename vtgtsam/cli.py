# SPDX-License-Identifier: MIT
"""The command line: ``vtgtsam evaluate``, ``vtgtsam inspect``, ...

Exit codes: 0 done; 1 an error that is to be expected, in one line on stderr, or ``inspect`` found a
problem; 2 wrong usage; 3 finished, but some sequences failed. Any other error is a mistake of this program,
which says so below its traceback; the exit code is 1.
"""

from __future__ import annotations

from typing import Annotated

import typer

from . import __version__
from .commands.attach_vision import attach_vision
from .commands.calibrate import calibrate
from .commands.check_hand import check_hand, suggest_pads
from .commands.check_mesh import check_mesh
from .commands.convert import convert
from .commands.edge import edge
from .commands.evaluate import evaluate
from .commands.export_lerobot import export_lerobot
from .commands.group import command_line
from .commands.inspect import inspect
from .commands.report import report
from .commands.ros import ros
from .commands.sdf import sdf
from .commands.view import view
from .commands.warm_up import warm_up

app = command_line("vtgtsam", completion=True)
for command in (
    evaluate,
    report,
    calibrate,
    inspect,
    view,
    convert,
    attach_vision,
    export_lerobot,
    check_hand,
    suggest_pads,
    check_mesh,
    sdf,
    warm_up,
):
    app.command()(command)
# What follows --ros-args is for ROS.
app.command(context_settings={"allow_extra_args": True, "ignore_unknown_options": True})(ros)


def _print_version(wanted: bool) -> None:
    if wanted:
        print(f"vtgtsam {__version__}")
        raise typer.Exit


@app.callback()
def vtgtsam(
    version: Annotated[
        bool,
        typer.Option("--version", callback=_print_version, is_eager=True, help="Say the version."),
    ] = False,
) -> None:
    """Where is the object in the robot's hand? Fuses vision, touch and non-penetration."""


def main() -> None:
    """Run the command line of this process."""
    with edge("vtgtsam"):
        app()


if __name__ == "__main__":
    main()
