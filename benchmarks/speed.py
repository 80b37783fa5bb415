# SPDX-License-Identifier: MIT
"""How long a frame takes, next to Theseus on the same core in the same minutes."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from vtgtsam import load_object

from . import problems
from .clock import pin
from .measure import Times, in_batches, ratio, take_turns
from .ours import Ours
from .problem import Problem
from .recorded import as_problem
from .report import machine, save, table
from .solver import Solver
from .theseus_process import TheseusProcess, absent, cuda_device

if TYPE_CHECKING:
    from matplotlib.figure import Figure

BATCHES = (1, 8, 64, 256)
THESEUS = "Theseus float32"  # what the ratios are to
BARE = "Theseus float32, bare SE(3)"


@dataclass(frozen=True)
class Case:
    """A problem and how it is run."""

    title: str
    problem: Problem
    tracked: bool
    block: int = 10


def cases(frames: int) -> list[Case]:
    """The standard problem, cold and tracked, and the built-in hand's pads."""
    isyhand = problems.isyhand_pads()
    drill = load_object("drill", origin="center").sdf
    single, tracked = problems.single_frames(frames), problems.sequence(frames)
    return [
        Case("Standard problem, unrelated frames", single, tracked=False),
        Case("Standard problem, tracked", tracked, tracked=True),
        Case(
            "Standard problem, unrelated frames, solvers alternating frame by frame",
            single,
            False,
            1,
        ),
        Case(
            "Standard problem, tracked, solvers alternating frame by frame",
            tracked,
            True,
            1,
        ),
        Case("Power drill, unrelated frames", problems.single_frames(frames, sdf=drill), False),
        Case("Power drill, tracked", problems.sequence(frames, sdf=drill), tracked=True),
        Case(
            "Built-in hand's pads, unrelated frames",
            problems.single_frames(frames, pads=isyhand),
            False,
        ),
        Case("Built-in hand's pads, tracked", problems.sequence(frames, pads=isyhand), True),
    ]


def ours(problem: Problem) -> list[Solver]:
    """Both of vtgtsam's solvers."""
    return [Ours(problem, "lm"), Ours(problem, "fixed-damping")]


def theseus(problem: Problem) -> list[Solver]:
    """The tuned Theseus variants."""
    return [
        TheseusProcess(problem, THESEUS),
        TheseusProcess(problem, "Theseus float64", dtype="float64"),
        TheseusProcess(problem, BARE, lie="bare"),
        TheseusProcess(problem, "Theseus float64, bare SE(3)", lie="bare", dtype="float64"),
    ]


def in_turn(problem: Problem) -> list[Solver]:
    """Ours and Theseus', so that each of ours finds the caches as a Theseus solver left them."""
    solvers = theseus(problem)
    for place, solver in zip((1, 3), ours(problem), strict=True):
        solvers.insert(place, solver)
    return solvers


def autodiff(problem: Problem) -> list[Solver]:
    """Theseus as a first user writes it."""
    return [
        TheseusProcess(problem, "Theseus autodiff, 2 pad costs", kind="autodiff"),
        TheseusProcess(problem, "Theseus autodiff, 32 pad costs", kind="autodiff", stacked=False),
    ]


def run(frames: int = 300, recording: Path | None = None) -> None:
    """Measure, and write ``speed.md``, ``speed.json`` and ``speed.png``."""
    core, reason = pin(), absent()
    text = [f"One core ({core}), one thread, {machine()['cpu']}."]
    data: dict[str, Any] = {"core": core, "cases": {}}
    if reason:
        text.append(f"Without Theseus: {reason}.")
    measured: dict[str, list[Times]] = {}
    chosen = cases(frames)
    if recording is not None:
        title = f"Recorded grasp {recording.stem}, tracked"
        chosen.append(Case(title, as_problem(recording), tracked=True))
    for number, case in enumerate(chosen):
        times = compare(case, ours if reason else in_turn, frames)
        times.sort(key=lambda time: "Theseus" in time.name)
        if number == 0 and not reason:
            times += compare(case, autodiff, 20)
        measured[case.title] = times
        text += ["", f"## {case.title}", "", table(rows(times))]
        data["cases"][case.title] = {time.name: time.summary() for time in times} | ratios(times)
    if not reason:
        batches = batched(problems.single_frames(max(BATCHES)))
        text += ["", "## Batches of unrelated frames, time a frame [ms]", "", table(batches)]
        data["batches"] = batches
    save("speed", "\n".join(text), data, {"speed": figure(measured)})


def compare(case: Case, build: Callable[[Problem], list[Solver]], frames: int) -> list[Times]:
    """Time the solvers on a case."""
    solvers = build(case.problem)
    try:
        count = min(frames, case.problem.frames)
        return take_turns(solvers, case.problem, count, case.block, case.tracked)
    finally:
        for solver in solvers:
            solver.close()


def rows(times: list[Times]) -> list[dict[str, Any]]:
    """The table of one case."""
    found = {time.name: time for time in times}
    table_rows = []
    for time in times:
        summary = time.summary()
        row: dict[str, Any] = {
            "solver": time.name,
            "median [ms]": summary["median_ms"],
            "p95 [ms]": summary["p95_ms"],
            "p99 [ms]": summary["p99_ms"],
            "p99 / median": summary["p99_ms"] / summary["median_ms"],
            "on the clock [ms]": summary["wall_median_ms"],
        }
        if THESEUS in found:
            row["Theseus / this"] = spread(found[THESEUS], time)
            row["bare Theseus / this"] = spread(found[BARE], time)
        table_rows.append(row)
    return table_rows


def spread(slow: Times, fast: Times) -> str:
    """The ratio with its 5th and 95th percentile over blocks."""
    if len(slow.blocks) != len(fast.blocks):  # measured apart
        return f"{slow.summary()['median_ms'] / fast.summary()['median_ms']:.2g}"
    r = ratio(slow, fast)
    return f"{r['median']:.3g} ({r['p5']:.3g}-{r['p95']:.3g})"


def ratios(times: list[Times]) -> dict[str, Any]:
    """Each Theseus variant's time over each of ours."""
    found = [(a, b) for a in times for b in times if "Theseus" in a.name and "vtgtsam" in b.name]
    return {
        f"{a.name} / {b.name}": {"cpu": ratio(a, b), "wall": ratio(a, b, "wall")}
        for a, b in found
        if len(a.blocks) == len(b.blocks)
    }


def batched(problem: Problem) -> list[dict[str, Any]]:
    """Time a frame when Theseus solves many at once, on the core and on CUDA where there is a device."""
    device = cuda_device()
    variants: dict[str, dict[str, Any]] = {
        THESEUS: {},
        BARE: {"lie": "bare"},
    }
    if device:
        variants |= {
            f"{name}, {device}": options | {"device": "cuda"} for name, options in variants.items()
        }
    table_rows = []
    for name, options in variants.items():
        solver = TheseusProcess(problem, name, **options)
        table_rows.append(
            {"solver": name}
            | {f"batch {size}": in_batches(solver, problem, size, 5) for size in BATCHES}
        )
        solver.close()
    return table_rows


def figure(measured: dict[str, list[Times]]) -> Figure:
    """Distribution of the frame times of the first case."""
    from matplotlib.figure import Figure

    times = next(iter(measured.values()))
    chart = Figure(figsize=(8, 0.5 * len(times) + 1.2), layout="constrained")
    axes = chart.subplots()
    axes.boxplot(
        [time.cpu_ms() for time in times],
        orientation="horizontal",
        tick_labels=[time.name for time in times],
        whis=(5, 95),
        showfliers=False,
    )
    axes.set_xscale("log")
    axes.invert_yaxis()
    axes.grid(axis="x", alpha=0.3)
    axes.set_xlabel("time a frame [ms]; box: quartiles, whiskers: 5 % to 95 %")
    axes.set_title("Standard problem, one core, one frame at a time", loc="left")
    return chart
