# SPDX-License-Identifier: MIT
"""Where a frame's time goes: GTSAM's own code, the callbacks into Python, the search for closest points, the rest.

A stopwatch stands at the doors between them and switches from one part to the other: inside GTSAM's optimiser a
factor's callback counts as callback, and the search that it asks for as search.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from typing import Any
from unittest.mock import patch

import gtsam
import numpy as np

from vtgtsam import estimator
from vtgtsam import solver as frame_solver
from vtgtsam.graph import FrameFactors
from vtgtsam.sdf.search import ClosestPoints

from . import problems
from .clock import pin
from .ours import Ours
from .problem import Problem
from .report import save, table

OUTSIDE = ""  # not of the frame
CHECKING, BUILDING, GTSAM = "checking the measurement", "building the graph", "GTSAM's optimiser"
CALLBACKS, SEARCH, REST = "callbacks", "searching closest points", "covariance, pads, status"
PARTS = (CHECKING, BUILDING, GTSAM, CALLBACKS, SEARCH, REST)
CASES = ("unrelated", "tracked")
SOLVERS = {"lm": "lm", "fixed-damping": "constant damping"}
PASSES = 3  # over the frames; each frame's least time counts
EMPTYING = 64_000_000  # [bytes] read and written, more than the caches hold

Parts = dict[str, float]


def run(frames: int = 100) -> None:
    """Measure, and write ``breakdown.md`` and ``breakdown.json``."""
    pin()
    text, data = [EXPLAINED.strip()], {}
    for case in CASES:
        problem = (problems.sequence if case == "tracked" else problems.single_frames)(frames)
        columns = {}
        for solver, name in SOLVERS.items():
            for emptied in (False, True):
                title = name + (", caches emptied" if emptied else "")
                columns[title] = measure(problem, solver, case == "tracked", emptied)
        text += ["", f"## Standard problem, {case} frames: running time [us]", ""]
        text += [table(rows(columns))]
        data[case] = columns
    save("breakdown", "\n".join(text), data, {})


EXPLAINED = """
Medians over frames of each frame's least time. "GTSAM's optimiser" is its C++ and the way from it to Python and back;
"callbacks" are the two factors' Python with all checks, also where the covariance asks for them. Reading the stopwatch
takes time too, so a frame without it is measured by itself. With caches emptied, 64 MB are written before each frame.
"""


class Stopwatch:
    """Running time of parts that call each other; a part's time is its own, without that of the parts it calls.

    Attributes:
        seconds: Time of each part [s].
        calls: How often each was entered.
        now: The part that is running.
    """

    def __init__(self) -> None:
        self.seconds: dict[str, float] = dict.fromkeys((OUTSIDE, *PARTS), 0.0)
        self.calls: Counter[str] = Counter()
        self.now, self._since = OUTSIDE, time.perf_counter()

    def around(self, part: str, function: Callable[..., Any]) -> Callable[..., Any]:
        """The function, on the part's account."""

        def timed(*arguments: Any, **named: Any) -> Any:
            before = self._switch(part)
            self.calls[part] += 1
            try:
                return function(*arguments, **named)
            finally:
                self._switch(before)

        return timed

    def _switch(self, part: str) -> str:
        now, before = time.perf_counter(), self.now
        self.seconds[before] += now - self._since
        self.now, self._since = part, now
        return before


@contextmanager
def watched(watch: Stopwatch) -> Iterator[None]:
    """The estimator's parts, on the stopwatch's account."""
    make: Callable[..., gtsam.CustomFactor] = gtsam.CustomFactor
    doors = (
        (estimator.PoseEstimator, "update", REST),
        (estimator, "check", CHECKING),
        (frame_solver, "frame_factors", BUILDING),
        (FrameFactors, "graph", BUILDING),
        (frame_solver, "optimize", GTSAM),
        (ClosestPoints, "search", SEARCH),
    )
    with ExitStack() as stack:
        for owner, name, part in doors:
            around = watch.around(part, getattr(owner, name))
            stack.enter_context(patch.object(owner, name, around))
        callback = patch.object(
            gtsam, "CustomFactor", lambda *a: make(*a[:-1], watch.around(CALLBACKS, a[-1]))
        )
        stack.enter_context(callback)
        yield


def measure(problem: Problem, solver: str, tracked: bool, emptied: bool) -> Parts:
    """Medians over frames: each part [us], a whole frame without stopwatch [us], callbacks and searches."""
    ours, caches = Ours(problem, solver), np.zeros(EMPTYING // 8 if emptied else 0)
    passes = [one_pass(ours, problem, tracked, caches) for _ in range(PASSES)]
    least = [
        {name: min(frame[name] for frame in same) for name in same[0]}
        for same in zip(*passes, strict=True)
    ]
    return {name: float(np.median([frame[name] for frame in least])) for name in least[0]}


def one_pass(ours: Ours, problem: Problem, tracked: bool, caches: np.ndarray) -> list[Parts]:
    """Each frame with the stopwatch and without."""
    found, T_wo = [], problem.T_start[0]
    for frame in range(problem.frames):
        start = (T_wo if tracked else problem.T_start[frame])[None]
        watch = Stopwatch()
        caches += 1
        with watched(watch):
            ours.solve(frame, start)
        before = (T_wo if tracked else problem.T_start[frame - 1])[None]
        ours.solve((frame - 1) % problem.frames, before)  # the search forgets this frame
        caches += 1
        solved = ours.solve(frame, start)
        T_wo = solved.T_wo[0]
        parts = {part: 1e6 * watch.seconds[part] for part in PARTS}
        parts |= {"whole": 1e6 * solved.time.cpu}
        found.append(
            parts
            | {
                f"{CALLBACKS}, calls": watch.calls[CALLBACKS],
                f"{SEARCH}, calls": watch.calls[SEARCH],
            }
        )
    return found


def rows(columns: dict[str, Parts]) -> list[dict[str, Any]]:
    """A row a part, a column a case."""
    shown: list[dict[str, Any]] = [
        {"part": part} | {name: found[part] for name, found in columns.items()} for part in PARTS
    ]
    sums = {name: sum(found[part] for part in PARTS) for name, found in columns.items()}
    whole = {name: found["whole"] for name, found in columns.items()}
    shown += [{"part": "= a frame"} | sums, {"part": "a frame without stopwatch"} | whole]
    for part, name in ((CALLBACKS, "callbacks"), (SEARCH, "searches")):
        calls = {title: round(found[f"{part}, calls"]) for title, found in columns.items()}
        shown.append({"part": f"{name} (number)"} | calls)
    return shown
