# SPDX-License-Identifier: MIT
"""Several solvers timed on the same frames, taking turns.

A machine's speed drifts with its other work, so solvers alternate in short blocks and are compared within a block.
Times are those the solver's thread was running: on a shared core the clock on the wall also counts its neighbours.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from .clock import Time
from .problem import Problem
from .solver import Solver


@dataclass
class Times:
    """One solver's times, a list a block."""

    name: str
    blocks: list[list[Time]] = field(default_factory=list)

    def cpu_ms(self) -> np.ndarray:
        """Running time of each frame [ms]."""
        return 1e3 * np.array([time.cpu for block in self.blocks for time in block])

    def wall_ms(self) -> np.ndarray:
        """Time on the clock of each frame [ms]."""
        return 1e3 * np.array([time.wall for block in self.blocks for time in block])

    def summary(self) -> dict[str, float]:
        """Median, percentiles [ms] and the share of frames that another process interrupted."""
        cpu = self.cpu_ms()
        return {
            "frames": len(cpu),
            "median_ms": float(np.median(cpu)),
            "p95_ms": float(np.percentile(cpu, 95)),
            "p99_ms": float(np.percentile(cpu, 99)),
            "wall_median_ms": float(np.median(self.wall_ms())),
            "interrupted": float(np.mean([t.preempted for block in self.blocks for t in block])),
        }


def take_turns(
    solvers: Sequence[Solver],
    problem: Problem,
    frames: int,
    block: int = 10,
    tracked: bool = False,
) -> list[Times]:
    """Time each solver on the problem's first ``frames`` frames, in blocks of ``block``.

    Before a block its solver solves the frame before, not counted, since it finds the caches as the other solver left
    them. With a block of 1 there is no such frame: each finds empty caches, and counts.

    Args:
        solvers: The solvers; each solves the same frames.
        problem: The problem.
        frames: Frames a solver.
        block: Frames in a row by the same solver.
        tracked: Whether a frame starts where the solver left the previous one, or at its own start.
    """
    times = [Times(solver.name) for solver in solvers]
    last = [problem.T_start[0] for _ in solvers]
    for solver in solvers:  # the very first call compiles, allocates, imports
        solver.solve(0, problem.T_start[:1])
    for begin in range(0, frames, block):
        batch = range(begin, min(begin + block, frames))
        for n, solver in enumerate(solvers):
            if block > 1:
                before = (begin - 1) % frames
                solver.solve(before, problem.T_start[before][None])
            measured = []
            for frame in batch:
                T_start = last[n] if tracked else problem.T_start[frame]
                solved = solver.solve(frame, T_start[None])
                last[n] = solved.T_wo[0]
                measured.append(solved.time)
            times[n].blocks.append(measured)
    return times


def ratio(slow: Times, fast: Times, clock: str = "cpu") -> dict[str, float]:
    """How many times faster, from the medians of each pair of blocks: median, 5th and 95th percentile."""
    ratios = [
        np.median([getattr(t, clock) for t in a]) / np.median([getattr(t, clock) for t in b])
        for a, b in zip(slow.blocks, fast.blocks, strict=True)
    ]
    low, middle, high = np.percentile(ratios, [5, 50, 95])
    return {"median": float(middle), "p5": float(low), "p95": float(high)}


def in_batches(solver: Solver, problem: Problem, size: int, repeats: int) -> float:
    """Median running time a frame [ms] when ``size`` frames are solved at once."""
    starts = problem.T_start[:size]
    solver.solve(0, starts, size)
    times: list[Any] = [solver.solve(0, starts, size).time for _ in range(repeats)]
    return 1e3 * float(np.median([time.cpu for time in times])) / size
