# SPDX-License-Identifier: MIT
"""The benchmarks' command line, ``python -m benchmarks``."""

from __future__ import annotations

import os

os.environ.setdefault(
    "OMP_NUM_THREADS", "1"
)  # before NumPy is loaded: everything here is one thread

from vtgtsam.commands.edge import edge
from vtgtsam.commands.group import command_line

from .commands import judging, timing

app = command_line("python -m benchmarks")
for command in (
    timing.speed,
    timing.accuracy,
    timing.scaling,
    timing.breakdown,
    timing.exactness,
    timing.soak,
    timing.remembering,
    timing.live,
    timing.tracker,
    timing.startup,
    timing.evaluation,
    timing.field,
    judging.consistency,
    judging.memory,
    judging.memory_settings,
    judging.images,
    judging.hand_back,
    judging.faults,
    judging.events,
    judging.calibration,
    judging.claims,
    judging.tuning,
    judging.experiments,
):
    app.command()(command)


@app.callback()
def benchmarks() -> None:
    """How fast and how exact the estimator is. Each command writes into benchmarks/results/."""


def main() -> None:
    """Run the command line of this process."""
    with edge("benchmarks"):
        app()


if __name__ == "__main__":
    main()
