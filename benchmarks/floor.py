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

import gtsam
import numpy as np

from vtgtsam.estimator import OBJECT
from vtgtsam.frame import check
from vtgtsam.graph import frame_factors
from vtgtsam.optimize import optimize

from . import problems
from .clock import pin
from .ours import Ours
from .problem import Problem
from .replay import Replay
from .report import save, table

COUNTED = 10  # frames run uncompiled
REPEATED = 20  # calls of each part
CASES = (("unrelated frames", False), ("tracked", True))


def run(frames: int = 100) -> None:
    """Measure, and write ``floor.md`` and ``floor.json``."""
    pin()
    text, data = [], {}
    for title, tracked in CASES:
        problem = (problems.sequence if tracked else problems.single_frames)(frames)
        for solver in ("lm", "fixed-damping"):
            counted = counts(problem, solver, tracked)
            us = costs(problem, solver, tracked)
            data[f"{title}, {solver}"] = {"counts": counted, "us": us}
            text += [f"## Standard problem, {title}, {solver}", "", table(rows(us)), ""]
            text += [summary(problem, us, counted), ""]
    save("floor", "\n".join(text).rstrip(), data, {})


def counts(problem: Problem, solver: str, tracked: bool) -> dict[str, float]:
    """What a frame does (see ``counts``), from a process in which nothing is compiled."""
    with tempfile.TemporaryDirectory() as folder:
        problem.save(f"{folder}/problem.npz")
        field = Ours(problem, solver).estimator.obj.sdf
        ((reach, planes),) = field._minorants.items()
        np.savez(f"{folder}/field.npz", reach=reach, planes=planes, lipschitz=field.lipschitz)
        arguments = [folder, solver, str(tracked), str(COUNTED)]
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
    ours, start, found = Ours(problem, solver), problem.T_start[0], []
    for frame in range(problem.frames):
        T_start = start if tracked else problem.T_start[frame]
        whole = ours.solve(frame, T_start[None])
        start = whole.T_wo[0]
        found.append({"frame": 1e6 * whole.time.cpu} | parts(ours, frame, T_start))
    return {name: float(np.median([each[name] for each in found])) for name in found[0]}


def parts(ours: Ours, frame: int, T_start: np.ndarray) -> dict[str, float]:
    """Running times of one frame's parts, each called again and again [us]."""
    estimator, measurement, config = ours.estimator, ours.measurements[frame], ours.estimator.config
    checked = check(measurement, estimator.hand)
    factors = frame_factors(checked, ours.closest, OBJECT, config)
    graph, T_ho, start = factors.graph(), gtsam.Pose3(T_start), gtsam.Values()
    start.insert(OBJECT, T_ho)
    solution = optimize(graph, start, config)
    return {
        "checking": median_us(lambda: check(measurement, estimator.hand)),
        "building": median_us(lambda: frame_factors(checked, ours.closest, OBJECT, config).graph()),
        "solving again": median_us(lambda: optimize(graph, start, config)),
        "concluding": median_us(
            lambda: estimator._estimate(checked, factors, graph, T_ho, solution)
        ),
        "GTSAM's optimiser": median_us(Replay(factors, start, config).solve),
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
    return us["checking"] + us["building"] + us["solving again"] + us["concluding"]


def rows(us: dict[str, float]) -> list[dict[str, Any]]:
    """The table of one case."""
    callbacks = us["solving again"] - us["GTSAM's optimiser"]
    return [
        {"part": "checking the measurement", "time [us]": us["checking"]},
        {"part": "building the graph", "time [us]": us["building"]},
        {"part": "GTSAM's optimiser, nothing to compute", "time [us]": us["GTSAM's optimiser"]},
        {"part": "distances and derivatives, closest points known", "time [us]": callbacks},
        {"part": "covariance, pads, status", "time [us]": us["concluding"]},
        {"part": "= the least", "time [us]": least(us)},
        {
            "part": "looking for the closest points, caches, calls",
            "time [us]": us["frame"] - least(us),
        },
        {"part": "= a frame", "time [us]": us["frame"]},
    ]


def summary(problem: Problem, us: dict[str, float], counted: dict[str, float]) -> str:
    """The case in words."""
    from vtgtsam.sdf.tiles import TILE

    plain = counted["searches"] * len(problem.points_p)
    quick = TILE * counted["tiles looked at"]
    return (
        f"A frame is {us['frame'] / least(us):.2g} times the least. It searches at {counted['searches']:.0f} poses, "
        f"bounds all tiles of a pad {counted['bounds']:.0f} times, looks at {quick:.0f} distances in single precision "
        f"and {counted['exact distances']:.0f} in double, where the plain search takes {plain:.0f}. It reads "
        f"{counted['grid [kB]']:.0f} kB of the grid and {counted['planes [kB]']:.0f} kB of linear functions below. "
        f"It calls GTSAM {counted['GTSAM calls']:.0f} times, which calls back {counted['callbacks']:.0f} times."
    )
