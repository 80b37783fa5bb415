# SPDX-License-Identifier: MIT
"""The independent NumPy implementation of the tests as a benchmark solver: slow, plain, and nobody's product."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path
from typing import Any

import numpy as np

from .clock import timed
from .problem import Problem
from .solver import Linearised, Solved


def _implementation() -> Any:
    """``tests/reference.py``; the tests are no package, so their folder is looked in for it."""
    folder = str(Path(__file__).resolve().parents[1] / "tests")
    if folder not in sys.path:
        sys.path.append(folder)
    return importlib.import_module("reference")


class Reference:
    """Solves a problem's frames with constant damping."""

    name = "reference"

    def __init__(self, problem: Problem) -> None:
        begin, end = problem.offsets[:-1], problem.offsets[1:]
        pads = [problem.points_p[a:b] for a, b in zip(begin, end, strict=True)]
        self.iterations, self.damping = problem.iterations, problem.damping
        self.frames = [
            _implementation().Problem(
                values=problem.values,
                lower=problem.lower,
                upper=problem.upper,
                pads=pads,
                T_wp=problem.T_wp[n],
                contacts=problem.contacts[n],
                T_visual=problem.T_visual[n],
                w_vis=tuple(problem.w_vis),
                w_tac=problem.w_tac,
                w_pen=problem.w_pen,
                log_theta_vis=problem.log_theta_vis,
                log_theta_tac=problem.log_theta_tac,
            )
            for n in range(problem.frames)
        ]

    def solve(self, frame: int, T_start: np.ndarray, batch: int = 1) -> Solved:
        """Solve one frame."""
        solve = self.frames[frame].fixed_damping
        time, T_wo = timed(lambda: solve(T_start[0], self.iterations, self.damping))
        return Solved(T_wo[None], time)

    def linearise(self, frame: int, T_wo: np.ndarray) -> Linearised:
        """The frame's objective at T_wo (4, 4)."""
        return Linearised(self.frames[frame].cost(T_wo), *self.frames[frame].normal_equations(T_wo))

    def close(self) -> None:
        """Nothing to let go of."""
