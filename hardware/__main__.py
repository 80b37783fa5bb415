# SPDX-License-Identifier: MIT
"""The real hand's command line: ``python -m hardware check | joints | calibrate-joints | pads | ... | run | off``.

Exit codes: 0 done; 1 an error that is to be expected, in one line on stderr; 2 wrong usage; 130 and 143
ended by Ctrl-C and SIGTERM, torque off. Any other error is a mistake of this program and shows its traceback.
"""

from __future__ import annotations

import functools
import logging
from collections.abc import Callable

import typer

from vtgtsam.commands.edge import edge
from vtgtsam.commands.group import command_line

from .commands.calibrate_wrist import calibrate_wrist
from .commands.check import check
from .commands.emulate import emulate
from .commands.joints import calibrate_joints, joints, off, reboot
from .commands.pads import calibrate_pads, pads
from .commands.run import run
from .stop_signals import stop_on_signals

INTERRUPTED = 130  # 128 + SIGINT, as shells count

app = command_line("python -m hardware")


def _interruptible(command: Callable[..., None]) -> Callable[..., None]:
    """The same command, for which Ctrl-C has the exit code that shells know."""

    @functools.wraps(command)
    def wrapped(*args: object, **kwargs: object) -> None:
        try:
            command(*args, **kwargs)
        except KeyboardInterrupt:
            typer.echo("hardware: interrupted", err=True)
            raise typer.Exit(INTERRUPTED) from None

    return wrapped


# In the order in which a person needs them who brings up a hand.
for command in (
    check, joints, calibrate_joints, pads, calibrate_pads, calibrate_wrist, run, off, reboot, emulate,
):  # fmt: skip
    app.command()(_interruptible(command))


@app.callback()
def hardware() -> None:
    """The real hand: servos, tactile pads, wrist tag, camera; or an emulation of them."""
    logging.basicConfig(level=logging.WARNING, format="%(levelname)s: %(message)s")


def main() -> None:
    """Run the command line of this process."""
    with edge("hardware"), stop_on_signals():
        app()


if __name__ == "__main__":
    main()
