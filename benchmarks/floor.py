# SPDX-License-Identifier: MIT
"""The least work a frame needs, what each part of it costs, and the frame as a multiple of that.

The least is taken to be the same frame solved a second time: the search then knows the closest points of every pose
that the solver asks for and has only to evaluate them, everything is in the processor's cache, and what remains is the
solver's arithmetic and what goes in and out.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from vtgtsam.conclusion import conclude
from vtgtsam.frame import check
from vtgtsam.solvers import steps

from . import problems
from .clock import pin
from .ours import Ours
from .problem import Problem
from .replay import Replay
from .report import save, table

COUNTED = 10  # frames run uncompiled
REPEATED = 20  # calls of each part
CASES = (("unrelated frames", False), ("tracked", True))
ENGINES = ("compiled", "gtsam")


def run(frames: int = 100) -> None:
    """Measure, and write ``floor.md`` and ``floor.json``."""
    pin()
    text, data = [], {}
    for title, tracked in CASES:
        problem = (problems.sequence if tracked else problems.single_frames)(frames)
        for solver in ("lm", "fixed-damping"):
            counted = {engine: counts(problem, solver, engine, tracked) for engine in ENGINES}
            us = costs(problem, solver, tracked)
            data[f"{title}, {solver}"] = {"counts": counted, "us": us}
            text += [f"## Standard problem, {title}, {solver}", "", table(rows(us)), ""]
            text += [summary(problem, us, **counted), ""]
    save("floor", "\n".join(text).rstrip(), data, {})


def counts(problem: Problem, solver: str, engine: str, tracked: bool) -> dict[str, float]:
    """What a frame does (see ``counts``), from a process in which nothing is compiled."""
    with tempfile.TemporaryDirectory() as folder:
        problem.save(f"{folder}/problem.npz")
        field = Ours(problem, solver).estimator.obj.sdf
        ((reach, planes),) = field._minorants.items()
        np.savez(f"{folder}/field.npz", reach=reach, planes=planes, lipschitz=field.lipschitz)
        arguments = [folder, solver, engine, str(tracked), str(COUNTED)]
        answer = subprocess.run(
            [sys.executable, "-W", "ignore", "-m", "benchmarks.counts", *arguments],
            cwd=Path(__file__).resolve().parents[1],
            env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
            capture_output=True,
            text=True,
            check=True,
        )
    return json.loads(answer.stdout)


def costs(problem: Problem, solver: str, tracked: bool) -> dict[str, float]:
    """Median running times [us] over frames: of the whole and of its parts, see ``rows``."""
    compiled, by_gtsam = Ours(problem, solver), Ours(problem, solver, engine="gtsam")
    start, found = problem.T_start[0], []
    for frame in range(problem.frames):
        T_start = start if tracked else problem.T_start[frame]
        whole = compiled.solve(frame, T_start[None])
        slow = by_gtsam.solve(frame, T_start[None])
        start = whole.T_wo[0]
        wholes = {"frame": 1e6 * whole.time.cpu, "frame by GTSAM": 1e6 * slow.time.cpu}
        found.append(wholes | parts(compiled, frame, T_start))
    return {name: float(np.median([each[name] for each in found])) for name in found[0]}


def parts(ours: Ours, frame: int, T_start: np.ndarray) -> dict[str, float]:
    """Running times of one frame's parts, each called again and again [us]."""
    estimator, measurement = ours.estimator, ours.measurements[frame]
    objective, config = estimator._objective, estimator.config
    checked = check(measurement, estimator.hand)
    objective.place(checked)
    solution = steps.solve(objective, T_start, config)
    return {
        "checking": median_us(lambda: check(measurement, estimator.hand)),
        "placing": median_us(lambda: objective.place(checked)),
        "solving again": median_us(lambda: steps.solve(objective, T_start, config)),
        "concluding": median_us(lambda: conclude(objective, solution.T_wo)),
        "GTSAM's optimiser": median_us(Replay(objective, checked, T_start, config).solve),
    }


def median_us(call: Callable[[], Any]) -> float:
    """Median running time of a call [us]."""
    taken = []
    for _ in range(REPEATED):
        begin = time.perf_counter()
        call()
        taken.append(time.perf_counter() - begin)
    return 1e6 * float(np.median(taken))


def least(us: dict[str, float]) -> float:
    """The least a frame needs [us]."""
    return us["checking"] + us["placing"] + us["solving again"] + us["concluding"]


def rows(us: dict[str, float]) -> list[dict[str, Any]]:
    """The table of one case."""
    return [
        {"part": "checking the measurement", "time [us]": us["checking"]},
        {"part": "placing pads and visual pose", "time [us]": us["placing"]},
        {"part": "solving, closest points known", "time [us]": us["solving again"]},
        {"part": "covariance, pads, status", "time [us]": us["concluding"]},
        {"part": "= the least", "time [us]": least(us)},
        {
            "part": "looking for the closest points, caches, calls",
            "time [us]": us["frame"] - least(us),
        },
        {"part": "= a frame", "time [us]": us["frame"]},
        {"part": "GTSAM's optimiser, nothing to compute", "time [us]": us["GTSAM's optimiser"]},
        {"part": "a frame with GTSAM's optimiser", "time [us]": us["frame by GTSAM"]},
    ]


def summary(
    problem: Problem, us: dict[str, float], compiled: dict[str, float], gtsam: dict[str, float]
) -> str:
    """The case in words."""
    from vtgtsam.sdf.tiles import TILE

    plain = compiled["searches"] * len(problem.points_p)
    quick = TILE * compiled["tiles looked at"]
    return (
        f"A frame is {us['frame'] / least(us):.2g} times the least. It searches at {compiled['searches']:.0f} poses, "
        f"bounds all tiles of a pad {compiled['bounds']:.0f} times, looks at {quick:.0f} distances in single precision "
        f"and {compiled['exact distances']:.0f} in double, where the plain search takes {plain:.0f}. It reads "
        f"{compiled['grid [kB]']:.0f} kB of the grid and {compiled['planes [kB]']:.0f} kB of linear functions below, "
        f"and calls GTSAM {compiled['GTSAM calls']:.0f} times, for poses. With GTSAM's optimiser it calls GTSAM "
        f"{gtsam['GTSAM calls']:.0f} times, which calls back {gtsam['callbacks']:.0f} times."
    )
