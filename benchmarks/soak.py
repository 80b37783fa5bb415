# SPDX-License-Identifier: MIT
"""A long run in one process: does memory grow, does a frame get slower?"""

from __future__ import annotations

import ctypes
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from . import problems
from .clock import pin
from .ours import Ours
from .report import save, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CYCLE = 500  # frames of the sequence that is repeated
SAMPLES = 50  # times that memory is read
PR_SET_THP_DISABLE = 41  # of Linux's prctl


def run(frames: int = 100_000, solver: str = "lm") -> None:
    """Measure, and write ``soak.md``, ``soak.json`` and ``soak.png``."""
    pin()
    without_huge_pages()
    ours = Ours(problem := problems.sequence(CYCLE), solver)
    T_wo, samples, times = problem.T_start[0], [], []
    every = max(1, frames // SAMPLES)
    for n in range(frames):
        frame = n % CYCLE
        solved = ours.solve(frame, (problem.T_start[0] if frame == 0 else T_wo)[None])
        T_wo = solved.T_wo[0]
        times.append(solved.time.cpu)
        if (n + 1) % every == 0:
            samples.append(
                {
                    "frame": n + 1,
                    "memory_mb": memory_mb(),
                    "median_ms": 1e3 * float(np.median(times)),
                }
            )
            times.clear()
    save(
        "soak",
        words(ours.name, samples),
        {"solver": solver, "samples": samples},
        {"soak": figure(samples)},
    )


def without_huge_pages() -> None:
    """Keep the system from merging this process's pages: it fills the gaps between them, which looks like growth."""
    ctypes.CDLL(None).prctl(PR_SET_THP_DISABLE, 1, 0, 0, 0)


def memory_mb() -> float:
    """Memory this process holds [MB]."""
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def words(solver: str, samples: list[dict[str, Any]]) -> str:
    """The result as text."""
    settled, last = samples[len(samples) // 10], samples[-1]
    growth = last["memory_mb"] - settled["memory_mb"]
    shown = [samples[n] for n in np.linspace(0, len(samples) - 1, 6).astype(int)]
    rows = [
        {"frame": s["frame"], "memory [MB]": f"{s['memory_mb']:.1f}", "median [ms]": s["median_ms"]}
        for s in shown
    ]
    return (
        f"{last['frame']:,} tracked frames of the standard problem in one process, {solver}. From frame "
        f"{settled['frame']:,} on memory grew by {growth:.1f} MB.\n\n{table(rows)}"
    )


def figure(samples: list[dict[str, Any]]) -> Figure:
    """Memory and time over frames."""
    from matplotlib.figure import Figure

    chart = Figure(figsize=(6, 4.5), layout="constrained")
    above, below = chart.subplots(2, sharex=True)
    frames = [s["frame"] for s in samples]
    above.plot(frames, [s["memory_mb"] for s in samples])
    above.set_ylabel("memory [MB]")
    below.plot(frames, [s["median_ms"] for s in samples])
    below.set_ylabel("median frame [ms]")
    below.set_ylim(bottom=0)
    below.set_xlabel("frame")
    for axes in (above, below):
        axes.grid(alpha=0.3)
    return chart
