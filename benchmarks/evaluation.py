# SPDX-License-Identifier: MIT
"""How long evaluating recordings takes: where a sequence's time goes, more sequences, a second process."""

from __future__ import annotations

import shutil
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from vtgtsam import EstimatorConfig, PoseEstimator, read_recording
from vtgtsam.evaluation import store
from vtgtsam.evaluation.estimates import estimates_table
from vtgtsam.evaluation.find import find_recordings
from vtgtsam.evaluation.methods import method_configs
from vtgtsam.evaluation.parquet import write_table
from vtgtsam.evaluation.run import run as evaluate
from vtgtsam.frame import contact_bits
from vtgtsam.metrics import Adds, add_each, relative_poses, rotation_errors, translation_errors
from vtgtsam.objects import mesh_of
from vtgtsam.recording.frames import evaluation_frames

from .clock import timed
from .recorded import simulate
from .report import save, table
from .scaling import SLOPE, slope

if TYPE_CHECKING:
    from matplotlib.figure import Figure

METHODS = ("vis", "vis+pen", "vis+tac+pen")
SEQUENCES = (8, 16, 32)  # evaluated at once
JOBS = (1, 2)
PARTS = ("reading", "object", "estimating", "ADD-S", "other errors", "writing")


def run(recordings: Path | None = None, folders: bool = True) -> None:
    """Measure, and write ``evaluation.md``, ``evaluation.json`` and two figures, one where ``folders`` is false."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if recordings is None:
            recordings = folder / "simulated"
            simulate(recordings)
        paths = list(find_recordings([recordings]).values())
        parts_of(paths[0], folder)  # compiles
        parts = [parts_of(path, folder) for path in paths]
        text = [f"## One sequence, {', '.join(METHODS)}: running time [ms]", "", table(parts)]
        data, figures = {"parts": parts}, {"evaluation_parts": parts_figure(parts)}
        if folders:
            words, of_folders, figures["evaluation"] = evaluate_folders(paths, folder)
            text += words
            data |= of_folders
    save("evaluation", "\n".join(text), data, figures)


def evaluate_folders(paths: list[Path], folder: Path) -> tuple[list[str], dict[str, Any], Figure]:
    """Whole evaluations by one process and by two: as text, as data and as a figure."""
    batches = with_speed_up([batch(paths, n, jobs, folder) for n in SEQUENCES for jobs in JOBS])
    slopes = {jobs: slope(*_curve(batches, jobs, "whole call [s]")) for jobs in JOBS}
    text = ["", "## Folders: time on the clock", "", table(batches), "", EXPLAINED, ""]
    text += [
        f"Slope in the number of sequences with {j} process(es): {s:.2f}. {SLOPE}"
        for j, s in slopes.items()
    ]
    return text, {"batches": batches, "slopes": slopes}, figure(batches, slopes)


EXPLAINED = (
    "Until the last sequence is done, which includes starting the processes; and the whole call, with the tables "
    "and tests that one process then makes of all of them. The speed-up is over one process, for either."
)


def parts_of(path: Path, folder: Path) -> dict[str, Any]:
    """Running times [ms] of one recording's parts, as ``vtgtsam.evaluation.sequence`` does them."""
    reading, recording = timed(lambda: read_recording(path))
    loading, obj = timed(lambda: (recording.hand, recording.object)[1])
    aligning, frames = timed(lambda: evaluation_frames(recording))
    estimating, estimates = timed(lambda: _estimates(recording, frames))
    truth = recording.truth_at([frame.time for frame in frames])
    pairs = [
        (estimate.T_wo, T_true)
        for of_method in estimates.values()
        for estimate, T_true in zip(of_method, truth, strict=True)
        if estimate.T_wo is not None and T_true is not None
    ]
    relating, relative = timed(lambda: relative_poses(*zip(*pairs, strict=True)))
    adds, _ = timed(lambda: Adds(obj.mesh).each(relative))
    others, _ = timed(lambda: _other_errors(obj, relative))
    contacts = [contact_bits(frame.contacts, recording.hand.pad_names) for frame in frames]
    writing, _ = timed(
        lambda: write_table(
            store.estimates_path(folder, path.stem), estimates_table(estimates, contacts), {}
        )
    )
    times = {
        "reading": reading.cpu + aligning.cpu,
        "object": loading.cpu,
        "estimating": estimating.cpu,
        "ADD-S": adds.cpu,
        "other errors": relating.cpu + others.cpu,
        "writing": writing.cpu,
    }
    solved = len(frames) * len(METHODS)
    return (
        {"recording": path.stem, "frames": solved, "vertices": len(mesh_of(obj).vertices)}
        | {part: 1e3 * times[part] for part in PARTS}
        | {"ADD-S a pair": 1e3 * adds.cpu / len(pairs)}
        | {"frames a second": round(solved / sum(times.values()))}
    )


def _estimates(recording: Any, frames: list[Any]) -> dict[str, list[Any]]:
    estimates = {}
    for name, config in method_configs(METHODS, EstimatorConfig.tuned()).items():
        estimator = PoseEstimator(recording.hand, recording.object, config)
        estimates[name] = [estimator.update(frame) for frame in frames]
    return estimates


def _other_errors(obj: Any, relative: np.ndarray) -> None:
    add_each(obj.mesh, relative)
    translation_errors(relative, obj.center)
    rotation_errors(relative, obj.symmetry)


def batch(paths: list[Path], count: int, jobs: int, folder: Path) -> dict[str, Any]:
    """Evaluate ``count`` recordings, the given ones over and over, with ``jobs`` processes."""
    given = folder / f"{count}_{jobs}"
    given.mkdir()
    for n in range(count):
        shutil.copy(paths[n % len(paths)], given / f"{n}.mcap")
    done = []
    begin = time.perf_counter()
    tables = evaluate(
        given,
        METHODS,
        "tuned",
        folder / f"out_{count}_{jobs}",
        jobs=jobs,
        progress=lambda outcome, _: done.append((time.perf_counter(), outcome)),
    )
    end = time.perf_counter()
    if tables.failed:
        raise RuntimeError(f"sequences failed: {tables.failed}")
    frames = sum(outcome.about["frames"] for _, outcome in done) * len(METHODS)
    last = done[-1][0]
    return {
        "sequences": count,
        "processes": jobs,
        "sequences [s]": last - begin,
        "tables [s]": end - last,
        "whole call [s]": end - begin,
        "frames a second and process": round(frames / (last - begin) / jobs),
    }


def with_speed_up(batches: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """The rows, each with how many times faster it is than one process with as many sequences."""
    alone = {row["sequences"]: row for row in batches if row["processes"] == 1}
    return [
        row
        | {
            f"speed-up, {what}": alone[row["sequences"]][f"{what} [s]"] / row[f"{what} [s]"]
            for what in ("sequences", "whole call")
        }
        for row in batches
    ]


def _curve(batches: list[dict[str, Any]], jobs: int, what: str) -> tuple[list[int], list[float]]:
    rows = [row for row in batches if row["processes"] == jobs]
    return [row["sequences"] for row in rows], [row[what] for row in rows]


def figure(batches: list[dict[str, Any]], slopes: dict[int, float]) -> Figure:
    """Time over sequences in logarithms, a line a number of processes, each named with its slope."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import NullFormatter

    chart = Figure(figsize=(5.5, 3.8), layout="constrained")
    axes = chart.subplots()
    for jobs in JOBS:
        count, seconds = _curve(batches, jobs, "whole call [s]")
        axes.plot(count, seconds, "o-", label=f"{jobs} process(es), slope {slopes[jobs]:.2f}")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks(SEQUENCES, [str(count) for count in SEQUENCES])
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel("sequences")
    axes.set_ylabel("time of the whole call [s]")
    axes.grid(alpha=0.3, which="both")
    axes.legend()
    return chart


def parts_figure(parts: list[dict[str, Any]]) -> Figure:
    """Each recording's parts as one bar."""
    from matplotlib.figure import Figure

    chart = Figure(figsize=(7.0, 1.5 + 0.25 * len(parts)), layout="constrained")
    axes = chart.subplots()
    names = [row["recording"] for row in parts]
    left = np.zeros(len(parts))
    for part in PARTS:
        width = np.array([row[part] for row in parts])
        axes.barh(names, width, left=left, label=part)
        left += width
    axes.invert_yaxis()
    axes.set_xlabel(f"running time of one sequence, {len(METHODS)} methods [ms]")
    axes.legend(ncols=len(PARTS), loc="lower center", bbox_to_anchor=(0.5, 1.0), fontsize="small")
    return chart
