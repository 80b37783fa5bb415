# SPDX-License-Identifier: MIT
"""How a frame's time grows with the problem: pads, points a pad, grid resolution, iterations."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from vtgtsam import Pad

from . import problems
from .clock import pin
from .measure import take_turns
from .ours import Ours
from .problem import Problem
from .report import save, table
from .solver import Solver
from .theseus_process import TheseusProcess, absent

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Sweep:
    """One quantity varied, the rest as in the standard problem.

    Attributes:
        quantity: What varies.
        values: Its values.
        build: The problem of so many frames at one value.
    """

    quantity: str
    values: Sequence[int]
    build: Callable[[int, int], Problem]


def _pads(count: int, frames: int) -> Problem:
    pads = [Pad(f"pad_{k}", problems.FINGER_PAD) for k in range(count)]
    return problems.sequence(frames, pads=pads)


def _points(count: int, frames: int) -> Problem:
    side = round(count**0.5)
    x, y = (np.linspace(-size / 2 + 0.002, size / 2 - 0.002, side) for size in problems.FINGER_PAD)
    points = np.stack(np.meshgrid(x, y, [0.0], indexing="ij"), axis=-1).reshape(-1, 3)
    pads = [Pad(f"pad_{k}", problems.FINGER_PAD, points) for k in range(16)]
    return problems.sequence(frames, pads=pads)


def _resolution(nodes: int, frames: int) -> Problem:
    return problems.sequence(frames, sdf=problems.lump(nodes))


def _iterations(count: int, frames: int) -> Problem:
    return problems.sequence(frames, iterations=count)


SWEEPS = (
    Sweep("pads", (4, 8, 16, 32, 64, 128, 256), _pads),
    Sweep("points a pad", (16, 64, 256, 1024, 4096), _points),
    Sweep("grid nodes a side", (32, 64, 128, 256, 512), _resolution),
    Sweep("iterations", (1, 2, 5, 10, 20), _iterations),
)


def run(frames: int = 40) -> None:
    """Measure, and write ``scaling.md``, ``scaling.json`` and a figure a quantity."""
    pin()
    reason = absent()
    text = [f"Without Theseus: {reason}.", ""] if reason else []
    text += [
        f"Medians of {frames} tracked frames [ms]; the rest as in the standard problem. {SLOPE}"
    ]
    data, figures = {}, {}
    for sweep in SWEEPS:
        curves = measure(sweep, frames, not reason)
        slopes = {name: slope(sweep.values, times) for name, times in curves.items()}
        text += ["", f"## {sweep.quantity}", "", table(rows(sweep, curves, slopes))]
        data[sweep.quantity] = {"values": list(sweep.values), "ms": curves, "slope": slopes}
        figures[f"scaling_{sweep.quantity.replace(' ', '_')}"] = figure(sweep, curves, slopes)
    save("scaling", "\n".join(text), data, figures)


SLOPE = (
    "The slope is that of the last three points in logarithms: 1 is proportional, 0 independent."
)


def measure(sweep: Sweep, frames: int, theseus: bool) -> dict[str, list[float]]:
    """Median running time of a frame [ms] of each solver at each value."""
    curves: dict[str, list[float]] = {}
    for value in sweep.values:
        problem = sweep.build(value, frames)
        solvers: list[Solver] = [Ours(problem, "lm"), Ours(problem, "fixed-damping")]
        if theseus:
            solvers.append(TheseusProcess(problem, "Theseus float32"))
        for times in take_turns(solvers, problem, frames, tracked=True):
            curves.setdefault(times.name, []).append(times.summary()["median_ms"])
        for solver in solvers:
            solver.close()
    return curves


def slope(values: Sequence[int], times: Sequence[float]) -> float:
    """Exponent with which time grows at the large end."""
    return float(np.polyfit(np.log(values[-3:]), np.log(times[-3:]), 1)[0])


def rows(
    sweep: Sweep, curves: dict[str, list[float]], slopes: dict[str, float]
) -> list[dict[str, Any]]:
    """A row a solver."""
    return [
        {"solver": name}
        | {str(value): time for value, time in zip(sweep.values, times, strict=True)}
        | {"slope": f"{slopes[name]:.2f}"}
        for name, times in curves.items()
    ]


def figure(sweep: Sweep, curves: dict[str, list[float]], slopes: dict[str, float]) -> Figure:
    """The curves in logarithms, each named with its slope."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import NullFormatter

    chart = Figure(figsize=(6.5, 4.2), layout="constrained")
    axes = chart.subplots()
    for name, times in curves.items():
        axes.plot(sweep.values, times, "o-", label=f"{name}, slope {slopes[name]:.2f}")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks(sweep.values, [str(value) for value in sweep.values])
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel(sweep.quantity)
    axes.set_ylabel("time a frame [ms]")
    axes.grid(alpha=0.3, which="both")
    chart.legend(loc="outside upper left", ncols=2, fontsize="small")
    return chart
