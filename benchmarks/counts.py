# SPDX-License-Identifier: MIT
"""Counts what a frame does, by running it uncompiled: poses, distances, bounds, bytes, calls into GTSAM and back.

Run by ``floor`` with NUMBA_DISABLE_JIT=1, so that the compiled loops run as plain Python over arrays that note every
number they are asked for. Slow, and exact: the same loops, nothing inserted into them.
"""

from __future__ import annotations

import cProfile
import json
import sys
from typing import Any

import numpy as np

from vtgtsam import GridSdf, ObjectModel

from .ours import Ours
from .problem import Problem

CACHE_LINE = 64  # [bytes]
COUNTED = {  # what is counted, by the name of the function
    "closest_on_pads": "searches",
    "look": "tiles looked at",
    "trilinear": "exact distances",
    "checked": "callbacks",
}


class Noted(np.ndarray):
    """An array that notes which of its cache lines are read."""

    lines: set[int] = set()  # of the class: ravel() makes new objects

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, tuple):
            at = np.ravel_multi_index(tuple(int(i) for i in index), self.shape)
        else:
            at = int(index)
        type(self).lines.add(int(at) * self.itemsize // CACHE_LINE)
        return super().__getitem__(index)

    @classmethod
    def kilobytes(cls) -> float:
        """Read since the start."""
        return len(cls.lines) * CACHE_LINE / 1024


class NotedGrid(Noted):
    """The distances at the nodes."""

    lines: set[int] = set()


class NotedPlanes(Noted):
    """The linear functions below the field."""

    lines: set[int] = set()


def count(folder: str, solver: str, tracked: bool, frames: int) -> dict[str, float]:
    """Medians over frames 1 to ``frames`` of the problem in ``folder``; frame 0 fills the search's memory."""
    problem = Problem.load(f"{folder}/problem.npz")
    obj = ObjectModel("object", noted_field(problem, f"{folder}/field.npz"))
    ours = Ours(problem, solver, obj)
    T_wo = ours.solve(0, problem.T_start[:1]).T_wo
    found = []
    for frame in range(1, frames + 1):
        NotedGrid.lines, NotedPlanes.lines = set(), set()
        profile = cProfile.Profile()
        profile.enable()
        T_wo = ours.solve(frame, T_wo if tracked else problem.T_start[frame : frame + 1]).T_wo
        profile.disable()
        found.append(of_one(profile))
    return {name: float(np.median([frame[name] for frame in found])) for name in found[0]}


def noted_field(problem: Problem, path: str) -> GridSdf:
    """The problem's field over arrays that note what is read; what compiled code prepares comes from a file."""
    field = GridSdf(problem.values, problem.lower, problem.upper)
    field.values = field.values.view(NotedGrid)
    with np.load(path) as prepared:
        field._minorants[int(prepared["reach"])] = prepared["planes"].view(NotedPlanes)
        field.__dict__["lipschitz"] = float(prepared["lipschitz"])
    return field


def of_one(profile: cProfile.Profile) -> dict[str, float]:
    """What one frame did."""
    found: dict[str, float] = dict.fromkeys([*COUNTED.values(), "bounds", "GTSAM calls"], 0)
    for entry in profile.getstats():
        if isinstance(entry.code, str):  # built in, or of an extension
            found["GTSAM calls"] += entry.callcount * ("gtsam" in entry.code)
        elif entry.code.co_name in COUNTED:
            found[COUNTED[entry.code.co_name]] += entry.callcount
        elif entry.code.co_name in ("bound_inside", "bound_anywhere"):
            found["bounds"] += entry.callcount
    return found | {"grid [kB]": NotedGrid.kilobytes(), "planes [kB]": NotedPlanes.kilobytes()}


if __name__ == "__main__":
    folder, solver, tracked, frames = sys.argv[1:]
    print(json.dumps(count(folder, solver, tracked == "True", int(frames))))
