# SPDX-License-Identifier: MIT
"""What memory gains: errors before and after the turn, and where something goes wrong in between.

Each recording is replayed with three methods and the recommended settings. Its error is the median ADD-S of its frames
in a phase, or of the frames from the disturbance's begin to half a second after its end.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from joblib import Parallel, delayed

from vtgtsam import Estimate, EstimatorConfig
from vtgtsam.config import CameraSigma
from vtgtsam.evaluation.phases import AFTER, BEFORE

from .disturbances import CASES
from .replay import FRAME_ALONE, MEMORY, VIS, Replay, below, consistency, errors_mm, estimator, load
from .replay import run as replayed
from .report import save, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

METHODS = {config.method: config for config in (VIS, FRAME_ALONE, MEMORY)}
LARGE_MM = 5.0

# Of a robot that is known to be perfectly calibrated.
EXACT = EstimatorConfig.tuned(joint_sigma=0.0, camera_sigma=CameraSigma(0.0, 0.0))

# Condition, case or phase, and method, with the median [mm] and the share of large errors of a recording.
Errors = dict[tuple[str, str, str], tuple[float, float]]
# Condition, phase and what the settings expect, with the mean NEES and the share inside the 95 % region.
Consistency = dict[tuple[str, str, str], tuple[float, float]]


def run(folders: Sequence[Path], disturbed: Sequence[Path], jobs: int) -> None:
    """Measure, and write ``memory.md``, ``memory.json`` and ``memory.png``.

    Args:
        folders: Recordings.
        disturbed: Those in which something goes wrong.
        jobs: Processes to use.
    """
    paths = below(folders)
    of_phase = Parallel(jobs)(delayed(by_phase)(path) for path in paths)
    found, consistent = [errors for errors, _ in of_phase], [c for _, c in of_phase]
    wrong_paths = below(disturbed)
    wrong = Parallel(jobs)(delayed(by_case)(path) for path in wrong_paths)
    phases, cases = rows(found, (BEFORE, AFTER)), rows(wrong, list(CASES))
    words = (
        f"{len(paths)} recordings. Medians of frames [mm], and of the recordings the median, the 90th percentile "
        f"and the largest; frames above {LARGE_MM:g} mm over all of them."
    )
    covers = consistency_rows(consistent)
    text = f"{words}\n\n{table(phases)}\n\nNEES a degree of freedom, and frames inside 95 % regions, modulo symmetry, "
    text += f"of {MEMORY.method}:\n\n{table(covers)}\n\n"
    text += f"Something goes wrong in the turn, or the object is taken out; {len(wrong)} recordings:\n\n"
    data = {"phases": phases, "cases": cases, "consistency": covers}
    save("memory", text + table(cases), data, {"memory": figure(found)})


def by_phase(path: Path) -> tuple[Errors, Consistency]:
    """A recording's figures before and after the turn."""
    replay = load(path)
    found: Errors = {}
    consistent: Consistency = {}
    for method, config in METHODS.items():
        estimates = replayed(estimator(replay, config), replay.frames)
        errors = errors_mm(replay.adds, estimates, replay.truths)
        for phase in (BEFORE, AFTER):
            found |= _figures(replay, phase, method, errors[replay.phases == phase])
        if config.memory:
            consistent |= _consistency(replay, "recommended settings", estimates)
    if "calibration error" not in replay.condition:
        estimates = replayed(estimator(replay, EXACT), replay.frames)
        consistent |= _consistency(replay, "a perfect robot", estimates)
    return found, consistent


def _consistency(replay: Replay, expected: str, estimates: Sequence[Estimate]) -> Consistency:
    judged, found = consistency(replay, estimates), {}
    for phase in (BEFORE, AFTER):
        chosen = judged.of(phase)
        if chosen.any():
            key = replay.condition, phase, expected
            found[key] = float(judged.values[chosen].mean()), float(judged.inside[chosen].mean())
    return found


def consistency_rows(found: Sequence[Consistency]) -> list[dict[str, Any]]:
    """A row a condition, phase and what the settings expect."""
    keys = sorted({key for of_recording in found for key in of_recording})
    made = []
    for condition, phase, expected in keys:
        key = condition, phase, expected
        values, inside = np.array([f[key] for f in found if key in f]).T
        made.append(
            {
                "condition": condition,
                "when": phase,
                "settings": expected,
                "recordings": len(values),
                "NEES, median": float(np.median(values)),
                "NEES, 90 %": float(np.quantile(values, 0.9)),
                "inside 95 % [%]": 1e2 * float(inside.mean()),
            }
        )
    return made


def by_case(path: Path) -> Errors:
    """A recording's figures where something goes wrong."""
    replay = load(path)
    found: Errors = {}
    for case, disturb in CASES.items():
        disturbed = disturb(replay)
        judged = np.flatnonzero(disturbed.judged)
        truths = [disturbed.truths[n] for n in judged]
        for method, config in METHODS.items():
            last = judged[-1] + 1
            estimates = replayed(estimator(replay, config), disturbed.frames[:last])
            errors = errors_mm(replay.adds, [estimates[n] for n in judged], truths)
            found |= _figures(replay, case, method, errors)
    return found


def _figures(replay: Replay, case: str, method: str, errors: np.ndarray) -> Errors:
    if not len(errors):
        return {}
    figures = float(np.median(errors)), float(np.mean(errors > LARGE_MM))
    return {(replay.condition, case, method): figures}


def rows(found: Sequence[Errors], cases: Sequence[str]) -> list[dict[str, Any]]:
    """A row a condition, case and method."""
    conditions = sorted({condition for errors in found for condition, *_ in errors})
    made = []
    for condition in conditions:
        for case in cases:
            for method in METHODS:
                values = [
                    e[condition, case, method] for e in found if (condition, case, method) in e
                ]
                if values:
                    made.append(_row(condition, case, method, np.array(values)))
    return made


def _row(condition: str, case: str, method: str, values: np.ndarray) -> dict[str, Any]:
    medians, large = values.T
    return {
        "condition": condition,
        "when": case,
        "method": method,
        "recordings": len(values),
        "median [mm]": float(np.median(medians)),
        "90 % [mm]": float(np.quantile(medians, 0.9)),
        "largest [mm]": float(medians.max()),
        f"above {LARGE_MM:g} mm [%]": 1e2 * float(large.mean()),
    }


def figure(found: Sequence[Errors]) -> Figure:
    """Each recording's error after the turn with memory over that without."""
    from matplotlib.figure import Figure

    chart = Figure(figsize=(5.0, 4.2), layout="constrained")
    axes = chart.subplots()
    conditions = sorted({condition for errors in found for condition, *_ in errors})
    for n, condition in enumerate(conditions):
        pairs = [
            [errors[condition, AFTER, method][0] for method in (FRAME_ALONE.method, MEMORY.method)]
            for errors in found
            if (condition, AFTER, MEMORY.method) in errors
        ]
        if pairs:
            axes.plot(*np.array(pairs).T, "o", color=f"C{n}", alpha=0.7, label=condition)
    ends = [0.03, 100.0]
    axes.plot(ends, ends, "k:", linewidth=1)
    axes.set(xscale="log", yscale="log", xlim=ends, ylim=ends)
    axes.set_xlabel(f"{FRAME_ALONE.method}: median after the turn [mm]")
    axes.set_ylabel(f"{MEMORY.method} [mm]")
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
    return chart
