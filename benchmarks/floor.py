# SPDX-License-Identifier: MIT
"""The least work a frame needs, what each part of it costs, and the frame as a multiple of that.

The least is taken to be: GTSAM's optimiser over the frame's factors, with callbacks that only hand out what they
computed the first time, and one exact distance and gradient a pad at every pose the optimiser asks for, as if the
closest points were known beforehand.
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
from unittest import mock

import gtsam
import numpy as np

from vtgtsam.factors.checked import checked_factor
from vtgtsam.factors.penetration import penetration_residual
from vtgtsam.factors.tactile import tactile_residual
from vtgtsam.frame import check
from vtgtsam.graph import OBJECT, GraphBuilder, as_graph
from vtgtsam.sdf.closest import ClosestPoints, PadContacts
from vtgtsam.solver import solve

from . import problems
from .clock import pin
from .ours import Ours
from .problem import Problem
from .report import save, table

COUNTED = 10  # frames run uncompiled
TIMED = 200  # calls of each part
CASES = (("unrelated frames", False), ("tracked", True))


def run(frames: int = 100) -> None:
    """Measure, and write ``floor.md`` and ``floor.json``."""
    pin()
    text, data = [], {}
    for title, tracked in CASES:
        make = problems.sequence if tracked else problems.single_frames
        problem = make(frames)
        for solver in ("lm", "fixed-damping"):
            found = {
                "counts": counts(problem, solver, tracked),
                "us": costs(problem, solver, tracked),
            }
            data[f"{title}, {solver}"] = found
            text += [f"## Standard problem, {title}, {solver}", "", table(rows(**found)), ""]
            text += [summary(problem, **found), ""]
    save("floor", "\n".join(text).rstrip(), data, {})


def counts(problem: Problem, solver: str, tracked: bool) -> dict[str, float]:
    """What a frame does (see ``counts``), from a process in which nothing is compiled."""
    with tempfile.TemporaryDirectory() as folder:
        path = f"{folder}/problem.npz"
        problem.save(path)
        answer = subprocess.run(
            [sys.executable, "-m", "benchmarks.counts", path, solver, str(tracked), str(COUNTED)],
            cwd=Path(__file__).resolve().parents[1],
            env=os.environ | {"NUMBA_DISABLE_JIT": "1"},
            capture_output=True,
            text=True,
            check=True,
        )
    return json.loads(answer.stdout)


def costs(problem: Problem, solver: str, tracked: bool) -> dict[str, float]:
    """Median running times [us] of a frame and its parts, see ``rows``."""
    ours = Ours(problem, solver)
    frame, solving = _frame_and_solving(ours, problem, tracked)
    middle = problem.frames // 2
    start = gtsam.Pose3(problem.T_start[middle])
    replay = Replay(ours, middle, start)
    points = np.ascontiguousarray(problem.points_p)
    sdf = ours.estimator.obj.sdf
    return {
        "frame": frame,
        "solving": solving,
        "optimiser": _median_us(replay.solve),
        "search that knows": _median_us(lambda: replay.closest.everywhere(start)),
        "plain distance": _median_us(lambda: sdf.value(points)) / len(points),
    }


def _frame_and_solving(ours: Ours, problem: Problem, tracked: bool) -> tuple[float, float]:
    """Median running times [us] of a whole frame and of ``solve`` within it."""
    inside: list[float] = []

    def timed_solve(*arguments: Any) -> Any:
        begin = time.thread_time()
        solution = solve(*arguments)
        inside.append(time.thread_time() - begin)
        return solution

    T_wo, frames = problem.T_start[0], []
    with mock.patch("vtgtsam.estimator.solve", timed_solve):
        for frame in range(problem.frames):
            solved = ours.solve(frame, (T_wo if tracked else problem.T_start[frame])[None])
            T_wo = solved.T_wo[0]
            frames.append(solved.time.cpu)
    return 1e6 * float(np.median(frames)), 1e6 * float(np.median(inside))


class Replay:
    """A frame's optimisation with callbacks that hand out what they computed once, in the same order."""

    def __init__(self, ours: Ours, frame: int, start: gtsam.Pose3) -> None:
        hand, self._config, self._start = ours.estimator.hand, ours.estimator.config, start
        checked = check(ours.measurements[frame], hand)
        self.closest = ClosestPoints(hand, ours.estimator.obj.sdf)
        self.closest.place(checked.T_wp, checked.touching)
        self._factors = GraphBuilder(self.closest, len(hand), self._config).build(checked)

        def tactile(at: PadContacts) -> Any:
            touching = np.flatnonzero(checked.touching)
            return tactile_residual(at.distances, at.jacobians, touching)

        def penetration(at: PadContacts) -> Any:
            return penetration_residual(at.distances, at.jacobians)

        self._answers: list[tuple[np.ndarray, np.ndarray]] = []
        self._next = 0
        kinds = (tactile, penetration)[-len(self._factors.hand) :]
        self._optimise([self._recording(kind) for kind in kinds])

    def solve(self) -> None:
        """Optimise once more."""
        self._next = 0
        self._optimise([self._replaying] * len(self._factors.hand))

    def _optimise(self, errors: list[Any]) -> None:
        hand = [
            checked_factor(factor.noiseModel(), [OBJECT], error)
            for factor, error in zip(self._factors.hand, errors, strict=True)
        ]
        graph = as_graph((self._factors.visual, *hand))
        solve(graph, OBJECT, self._start, self._config)

    def _recording(self, kind: Callable[[PadContacts], Any]) -> Any:
        def error(factor: Any, values: gtsam.Values, jacobians: list[Any] | None) -> np.ndarray:
            self._answers.append(kind(self.closest.at(values.atPose3(OBJECT))))
            return self._give(self._answers[-1], jacobians)

        return error

    def _replaying(self, factor: Any, values: Any, jacobians: list[Any] | None) -> np.ndarray:
        self._next += 1
        return self._give(self._answers[self._next - 1], jacobians)

    @staticmethod
    def _give(answer: Any, jacobians: list[Any] | None) -> np.ndarray:
        if jacobians is not None:
            jacobians[0] = answer[1]
        return answer[0]


def _median_us(call: Callable[[], Any]) -> float:
    call()
    taken = []
    for _ in range(TIMED):
        begin = time.thread_time()
        call()
        taken.append(time.thread_time() - begin)
    return 1e6 * float(np.median(taken))


def rows(counts: dict[str, float], us: dict[str, float]) -> list[dict[str, Any]]:
    """The table of one case."""
    known = counts["search"] * us["search that knows"]
    least = us["optimiser"] + known
    return [
        _part("the optimiser and its calls back, nothing to compute", 1, us["optimiser"]),
        _part(
            "closest points, were they known, at each pose",
            counts["search"],
            us["search that knows"],
        ),
        _part("= the least", 1, least),
        _part("looking for the closest points", 1, us["solving"] - least),
        _part("checks, graph, covariance, status", 1, us["frame"] - us["solving"]),
        _part("= a frame", 1, us["frame"]),
    ]


def _part(name: str, count: float, each: float) -> dict[str, Any]:
    return {"part": name, "a frame": round(count), "each [us]": each, "together [us]": count * each}


def summary(problem: Problem, counts: dict[str, float], us: dict[str, float]) -> str:
    """The case in words."""
    floor = us["optimiser"] + counts["search"] * us["search that knows"]
    plain = counts["search"] * len(problem.points_p)
    return (
        f"A frame is {us['frame'] / floor:.2g} times the least. It looks at {counts['quick']:.0f} distances in single "
        f"precision and {counts['exact']:.0f} in double, where the plain search takes {plain:.0f} in double "
        f"({plain * us['plain distance'] / 1e3:.2g} ms). It touches {counts['kilobytes']:.0f} kB of the grid and calls "
        f"GTSAM {counts['gtsam']:.0f} times, which calls back {counts['callback']:.0f} times."
    )
