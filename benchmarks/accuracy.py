# SPDX-License-Identifier: MIT
"""Whether all solve the same problem, and how near the truth they come in how much time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import gtsam
import numpy as np

from vtgtsam import ObjectModel, load_object
from vtgtsam.metrics import Adds

from . import problems
from .clock import pin
from .measure import Times, take_turns
from .ours import Ours
from .problem import Problem
from .reference import Reference
from .report import save, table
from .solver import Solver
from .theseus_process import TheseusProcess, absent

if TYPE_CHECKING:
    from matplotlib.figure import Figure

OBJECTS = ("can", "mug", "banana", "box", "bottle", "pear", "padlock", "drill")
TUNED = {"w_vis": np.array([0.01, 1.0]), "w_tac": 10.0, "w_pen": 10.0}
SETTINGS: dict[str, dict[str, Any]] = {"weights 1, 1, 1": {}, "tuned weights": TUNED}
COMPARED = 10  # frames compared with the reference
SETTLED = 10  # frames after which a tracker counts as tracking


def run(frames: int = 100) -> None:
    """Measure, and write ``accuracy.md``, ``accuracy.json`` and ``accuracy.png``."""
    pin()
    reason = absent()
    text = ["## The same problem", "", AGREEMENT.strip(), ""]
    agreement = agreements(problems.single_frames(COMPARED), theseus=not reason)
    text += [table(agreement)]
    tracked = [
        row
        for name in OBJECTS
        for row in tracking(load_object(name, origin="center"), frames, not reason)
    ]
    text += ["", "## Error and time of tracked sequences", "", TRACKING.strip(), ""]
    text += [table(over_objects(tracked)), "", table(by_object(tracked))]
    if reason:
        text += ["", f"Without Theseus: {reason}."]
    save(
        "accuracy",
        "\n".join(text),
        {"agreement": agreement, "tracking": tracked},
        {"accuracy": figure(tracked)},
    )


AGREEMENT = """
Largest difference to an independent NumPy implementation over ten frames of the standard problem: the objective at
each frame's start, and the pose after five steps of constant damping (`lm` adapts its damping, so its pose is another).
"""
TRACKING = """
ADD-S is the mean distance of the object's vertices at the estimate to its surface at the truth. Sixteen pads around
each object, a turning hand, a slipping object, a visual pose that is off by a changing millimetre or two and degree or
two. The first ten frames are left out.
"""


def agreements(problem: Problem, theseus: bool) -> list[dict[str, Any]]:
    """Each solver's largest differences to the reference."""
    reference = Reference(problem)
    solvers: list[Solver] = [
        Ours(problem, "fixed-damping"),
        Ours(problem, "lm"),
    ]
    if theseus:
        solvers += [
            TheseusProcess(problem, "Theseus float64", dtype="float64"),
            TheseusProcess(problem, "Theseus float64, bare SE(3)", dtype="float64", lie="bare"),
            TheseusProcess(problem, "Theseus float64, autodiff", kind="autodiff", dtype="float64"),
            TheseusProcess(problem, "Theseus float32"),
        ]
    rows = []
    for solver in solvers:
        worst = np.max(
            [difference(solver, reference, problem, n) for n in range(problem.frames)], axis=0
        )
        keys = ("cost, relative", "J'WJ, relative", "J'Wr, relative", "pose after 5 steps [m, 1]")
        rows.append({"solver": solver.name} | dict(zip(keys, map(float, worst), strict=True)))
        solver.close()
    return rows


def difference(solver: Solver, reference: Solver, problem: Problem, frame: int) -> list[float]:
    """Differences of one frame: cost, information, gradient, and the solved pose's largest entry."""
    start = problem.T_start[frame]
    ours, theirs = solver.linearise(frame, start), reference.linearise(frame, start)
    solved = solver.solve(frame, start[None]).T_wo - reference.solve(frame, start[None]).T_wo
    return [
        abs(ours.cost / theirs.cost - 1),
        np.abs(ours.information - theirs.information).max() / np.abs(theirs.information).max(),
        np.abs(ours.gradient - theirs.gradient).max() / np.abs(theirs.gradient).max(),
        np.abs(solved).max(),
    ]


def tracking(obj: ObjectModel, frames: int, theseus: bool) -> list[dict[str, Any]]:
    """Errors and times of one object's sequence, a row a setting and solver."""
    rows = []
    for setting, values in SETTINGS.items():
        problem = problems.sequence(frames, sdf=obj.sdf, **values)
        solvers: list[Solver] = [
            Ours(problem, "lm"),
            Ours(problem, "fixed-damping"),
        ]
        if theseus:
            solvers.append(TheseusProcess(problem, "Theseus float32"))
        adds = Adds(obj.mesh)
        rows.append(
            _row(
                obj.name,
                setting,
                "visual pose alone",
                _errors(adds, problem, problem.T_visual),
                None,
            )
        )
        for solver, times, T_wo in zip(solvers, *_tracked(solvers, problem), strict=True):
            rows.append(_row(obj.name, setting, solver.name, _errors(adds, problem, T_wo), times))
            solver.close()
    return rows


def _tracked(solvers: Sequence[Solver], problem: Problem) -> tuple[list[Times], list[np.ndarray]]:
    recorders = [_Recorder(solver, problem.frames) for solver in solvers]
    times = take_turns(recorders, problem, problem.frames, tracked=True)
    return times, [recorder.T_wo for recorder in recorders]


class _Recorder:
    """A solver that keeps what it found last for each frame."""

    def __init__(self, solver: Solver, frames: int) -> None:
        self.name, self.linearise, self.close = solver.name, solver.linearise, solver.close
        self._solver = solver
        self.T_wo = np.zeros((frames, 4, 4))

    def solve(self, frame: int, T_start: np.ndarray, batch: int = 1) -> Any:
        solved = self._solver.solve(frame, T_start, batch)
        self.T_wo[frame] = solved.T_wo[0]
        return solved


def _errors(adds: Adds, problem: Problem, T_wo: np.ndarray) -> np.ndarray:
    pairs = list(zip(T_wo, problem.T_true, strict=True))[SETTLED:]
    return np.array([adds(gtsam.Pose3(a), gtsam.Pose3(b)) for a, b in pairs])


def _row(
    obj: str, setting: str, name: str, errors: np.ndarray, times: Times | None
) -> dict[str, Any]:
    return {
        "object": obj,
        "setting": setting,
        "solver": name,
        "adds_median_mm": 1e3 * float(np.median(errors)),
        "adds_p95_mm": 1e3 * float(np.percentile(errors, 95)),
        "time_median_ms": None if times is None else times.summary()["median_ms"],
    }


def over_objects(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Medians over the objects."""
    merged = []
    for setting, solver in dict.fromkeys((row["setting"], row["solver"]) for row in rows):
        chosen = [row for row in rows if (row["setting"], row["solver"]) == (setting, solver)]
        times = [row["time_median_ms"] for row in chosen if row["time_median_ms"] is not None]
        merged.append(
            {
                "setting": setting,
                "solver": solver,
                "ADD-S, median [mm]": float(np.median([row["adds_median_mm"] for row in chosen])),
                "ADD-S, p95 [mm]": float(np.median([row["adds_p95_mm"] for row in chosen])),
                "time [ms]": float(np.median(times)) if times else None,
            }
        )
    return merged


def by_object(rows: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Median ADD-S [mm] of each object with the tuned weights, a column a solver."""
    tuned = [row for row in rows if row["setting"] == "tuned weights"]
    return [
        {"object": name}
        | {row["solver"]: row["adds_median_mm"] for row in tuned if row["object"] == name}
        for name in dict.fromkeys(row["object"] for row in tuned)
    ]


def figure(rows: list[dict[str, Any]]) -> Figure:
    """ADD-S over time a frame, a point an object."""
    from matplotlib.figure import Figure

    chart = Figure(figsize=(7, 4), layout="constrained")
    axes = chart.subplots()
    tuned = [row for row in rows if row["setting"] == "tuned weights"]
    for name in dict.fromkeys(row["solver"] for row in tuned if row["time_median_ms"]):
        chosen = [row for row in tuned if row["solver"] == name]
        axes.plot(
            [row["time_median_ms"] for row in chosen],
            [row["adds_median_mm"] for row in chosen],
            "o",
            label=name,
            alpha=0.7,
        )
    visual = [row["adds_median_mm"] for row in tuned if row["time_median_ms"] is None]
    axes.axhline(
        np.median(visual), color="grey", linestyle="--", label="visual pose alone (median)"
    )
    axes.set_xscale("log")
    axes.set_ylim(bottom=0)
    axes.set_xlabel("time a frame [ms]")
    axes.set_ylabel("median ADD-S [mm]")
    axes.grid(alpha=0.3)
    axes.legend()
    return chart
