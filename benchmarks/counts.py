# SPDX-License-Identifier: MIT
"""Counts what a frame does, by running it uncompiled: distances looked at, nodes read, calls into GTSAM and back.

Run by ``floor`` with NUMBA_DISABLE_JIT=1, so that the compiled loops run as plain Python over an array that notes
every node it is asked for. Slow, and exact: the same loops, nothing inserted into them.
"""

from __future__ import annotations

import cProfile
import json
import sys
from typing import Any

import numpy as np

CACHE_LINE = 64  # [bytes]


class Counted(np.ndarray):
    """Grid values that count the nodes read: one index is the single-precision pass, three are the exact one."""

    quick, exact, lines = 0, 0, set()  # of the class: ravel() makes new objects

    def __getitem__(self, index: Any) -> Any:
        if isinstance(index, tuple):
            Counted.exact += 1
            flat = np.ravel_multi_index(tuple(int(i) for i in index), self.shape)
        else:
            Counted.quick += 1
            flat = int(index)
        Counted.lines.add(int(flat) * 4 // CACHE_LINE)
        return super().__getitem__(index)

    @classmethod
    def start(cls) -> None:
        """Count from zero."""
        cls.quick, cls.exact, cls.lines = 0, 0, set()


def count(path: str, solver: str, tracked: bool, frames: int) -> dict[str, float]:
    """Medians over frames 1 to ``frames`` of the problem at ``path``; frame 0 fills the search's memory."""
    from .ours import Ours
    from .problem import Problem

    problem = Problem.load(path)
    ours = Ours(problem, solver)
    field = ours.estimator.obj.sdf
    field.values = field.values.view(Counted)
    ours = Ours(problem, solver, ours.estimator.obj)
    T_wo = ours.solve(0, problem.T_start[:1]).T_wo
    found = []
    for frame in range(1, frames + 1):
        Counted.start()
        profile = cProfile.Profile()
        profile.enable()
        T_wo = ours.solve(frame, T_wo if tracked else problem.T_start[frame : frame + 1]).T_wo
        profile.disable()
        found.append(_of_one(profile))
    return {name: float(np.median([frame[name] for frame in found])) for name in found[0]}


def _of_one(profile: cProfile.Profile) -> dict[str, float]:
    calls = {"search": 0, "callback": 0, "gtsam": 0}
    for entry in profile.getstats():
        if isinstance(entry.code, str):  # built in, or of an extension
            calls["gtsam"] += entry.callcount * ("gtsam" in entry.code)
        elif entry.code.co_name == "closest_on_pads":
            calls["search"] += entry.callcount
        elif entry.code.co_name == "checked":
            calls["callback"] += entry.callcount
    return calls | {
        "quick": Counted.quick / 8,
        "exact": Counted.exact / 8,
        "kilobytes": len(Counted.lines) * CACHE_LINE / 1024,
    }


if __name__ == "__main__":
    path, solver, tracked, frames = sys.argv[1:]
    print(json.dumps(count(path, solver, tracked == "True", int(frames))))
