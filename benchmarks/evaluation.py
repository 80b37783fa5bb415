# SPDX-License-Identifier: MIT
"""How long evaluating recordings takes: where a sequence's time goes, more sequences, a second process."""

from __future__ import annotations

import shutil
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vtgtsam import EstimatorConfig, PoseEstimator, evaluate, read_recording
from vtgtsam.evaluation.find import find_recordings
from vtgtsam.evaluation.frames import evaluation_frames
from vtgtsam.metrics import Adds

from .recorded import simulate
from .report import save, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

METHODS = ("vis", "vis+pen", "vis+tac+pen")
SEQUENCES = (4, 8, 16)  # evaluated at once
JOBS = (1, 2)


def run(recordings: Path | None = None) -> None:
    """Measure, and write ``evaluation.md``, ``evaluation.json`` and ``evaluation.png``."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if recordings is None:
            recordings = folder / "simulated"
            simulate(recordings)
        paths = list(find_recordings([recordings]).values())
        parts = [parts_of(path) for path in paths]
        batches = [batch(paths, count, jobs, folder) for count in SEQUENCES for jobs in JOBS]
    text = ["## One sequence, one method, running time", "", table(parts), ""]
    text += [f"## Folders, {', '.join(METHODS)}, time on the clock", "", table(batches)]
    save(
        "evaluation",
        "\n".join(text),
        {"parts": parts, "batches": batches},
        {"evaluation": figure(batches)},
    )


def parts_of(path: Path) -> dict[str, Any]:
    """Running times of one recording's parts."""
    read, recording = _timed(lambda: _read(path))
    frames = evaluation_frames(recording)
    estimator = PoseEstimator(recording.hand, recording.object, EstimatorConfig.tuned())
    estimator.update(frames[0])
    estimator.reset()
    estimate, estimates = _timed(lambda: [estimator.update(frame) for frame in frames])
    truths = recording.truth_at([frame.time for frame in frames])
    pairs = [(e.T_wo, T) for e, T in zip(estimates, truths, strict=True) if T is not None]
    adds = Adds(recording.object.mesh)
    adds(*pairs[0])
    measure, _ = _timed(lambda: [adds(*pair) for pair in pairs])
    return {
        "recording": path.stem,
        "frames": len(frames),
        "vertices": len(recording.object.mesh.vertices),
        "reading [ms]": 1e3 * read,
        "estimating [ms a frame]": 1e3 * estimate / len(frames),
        "ADD-S [ms a frame]": 1e3 * measure / len(pairs),
        "frames a second": len(frames) / (read + estimate + measure),
    }


def _read(path: Path) -> Any:
    recording = read_recording(path)
    evaluation_frames(recording)
    return recording


def _timed(call: Callable[[], Any]) -> tuple[float, Any]:
    begin = time.thread_time()
    result = call()
    return time.thread_time() - begin, result


def batch(paths: list[Path], count: int, jobs: int, folder: Path) -> dict[str, Any]:
    """Evaluate ``count`` recordings, the given ones over and over, with ``jobs`` processes."""
    given = folder / f"{count}_{jobs}"
    given.mkdir()
    for n in range(count):
        shutil.copy(paths[n % len(paths)], given / f"{n}.mcap")
    begin = time.perf_counter()
    summary = evaluate(given, METHODS, "tuned", folder / f"out_{count}_{jobs}", jobs=jobs)
    seconds = time.perf_counter() - begin
    if summary.attrs["failed"]:
        raise RuntimeError(f"sequences failed: {summary.attrs['failed']}")
    return {
        "sequences": count,
        "processes": jobs,
        "time [s]": seconds,
        "sequences a second": count / seconds,
    }


def figure(batches: list[dict[str, Any]]) -> Figure:
    """Time over sequences, a line a number of processes, with the time of one more sequence."""
    from matplotlib.figure import Figure

    chart = Figure(figsize=(5.5, 3.8), layout="constrained")
    axes = chart.subplots()
    for jobs in JOBS:
        rows = [row for row in batches if row["processes"] == jobs]
        count, seconds = [row["sequences"] for row in rows], [row["time [s]"] for row in rows]
        slope = np.polyfit(count, seconds, 1)[0]
        axes.plot(count, seconds, "o-", label=f"{jobs} process(es): {slope:.2g} s a sequence")
    axes.set_xlabel("sequences")
    axes.set_ylabel("time [s]")
    axes.set_xlim(left=0)
    axes.set_ylim(bottom=0)
    axes.grid(alpha=0.3)
    axes.legend()
    return chart
