# SPDX-License-Identifier: MIT
"""What a robot gains from calibrating itself, by how many grasps it has made before.

Each robot has its own camera error and joint zeros (as ``python -m sim generate --robot`` draws them), makes its
earlier grasps in an order of its own, and is judged on grasps that were not among them: ADD-S after the hand's turn.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from functools import cache, partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from vtgtsam import Calibration, EstimatorConfig, Measurement, PoseEstimator, read_recording
from vtgtsam.calibration.calibrate import run as calibrate
from vtgtsam.calibration.robot import Robot
from vtgtsam.evaluation.engine import run_tasks
from vtgtsam.evaluation.find import find_recordings
from vtgtsam.evaluation.phases import AFTER, turn_phases
from vtgtsam.metrics import Adds, relative_poses
from vtgtsam.recording import Recording
from vtgtsam.recording.frames import evaluation_frames

from .imposed import as_robot, true_offsets
from .report import save, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

METHODS = ("vis", "vis+tac+pen", "vis+tac+pen+mem")
FIRST_ROBOT = 5000  # lower numbers are for choosing settings
EVERY = 5  # frames, of which one is compared with the truth
FAR = 5e-3  # [m], an error above is a lost object
EXACT = 1e-6  # standard deviation of offsets that are given, rad and m
LIMIT = "true offsets"  # in the place of a number of grasps


class Case(NamedTuple):
    """One robot, and what it did before.

    Attributes:
        robot: Its number; None: one without error.
        earlier: Recordings of its earlier grasps, in their order.
        tests: Recordings that it is judged on.
        counts: Numbers of earlier grasps to calibrate from.
    """

    robot: int | None
    earlier: tuple[Path, ...]
    tests: tuple[Path, ...]
    counts: tuple[int, ...]


def run(recordings: Path, robots: int, tests: int, counts: Sequence[int], jobs: int) -> None:
    """Measure, and write ``calibration.md``, ``calibration.json`` and ``calibration.png``."""
    paths = list(find_recordings([recordings]).values())
    cases = list(_cases(paths, robots, tests, counts))
    found: list[dict[str, Any]] = []
    for done, rows in enumerate(run_tasks(judge, cases, jobs), 1):
        found += rows
        print(f"{done} of {len(cases)} robots", flush=True)
    errors = [
        _errors_row(*key, rows) for key, rows in _grouped(found, "robot has", "method", "grasps")
    ]
    offsets = [
        _offsets_row(*key, rows)
        for key, rows in _grouped([row for row in found if "nees" in row], "robot has", "grasps")
    ]
    text = (
        f"{robots} robots, {tests} grasps each to judge them by, of {len(paths)} recordings. "
        f"ADD-S [mm] after the turn, median of each recording.\n\n{table(errors)}\n\n"
        f"The offsets, 6 of the camera and one a joint:\n\n{table(offsets)}"
    )
    save("calibration", text, {"rows": found}, {"calibration": figure(errors)})


def _cases(paths: Sequence[Path], robots: int, tests: int, counts: Sequence[int]) -> Iterator[Case]:
    """The robots, and one without error last."""
    for n in range(robots + 1):
        order = np.random.default_rng(n).permutation(len(paths)).tolist()
        earlier = [paths[i] for i in order[tests:]]
        usable = tuple(count for count in counts if count <= len(earlier))
        robot = FIRST_ROBOT + n if n < robots else None
        yield Case(robot, tuple(earlier), tuple(paths[i] for i in order[:tests]), usable)


def judge(case: Case) -> list[dict[str, Any]]:
    """A row for each number of grasps, method and test recording."""
    rows: list[dict[str, Any]] = []
    judged = partial(_judged, case)
    for count in case.counts:
        calibration, about = None, {}
        if count:
            calibration, about = _calibrated(case, count)
        for row in judged(count, calibration):
            rows.append(row | about)
            about = {}
    if case.robot is not None:
        rows += judged(LIMIT, _known(case))
    return rows


def _calibrated(case: Case, count: int) -> tuple[Calibration, dict[str, Any]]:
    """A calibration from the first ``count`` grasps, and how good it is."""
    earlier = [as_robot(_load(path), case.robot) for path in case.earlier[:count]]
    start = time.process_time()
    result = calibrate(earlier)
    seconds = time.process_time() - start
    calibration = result.calibration
    true = true_offsets(case.robot, len(calibration.joint_names), calibration.camera_origin)
    off = calibration.offsets - true
    return calibration, {
        "nees": float(off @ np.linalg.solve(calibration.covariance, off)) / len(off),
        "joints_rad": float(np.sqrt(np.square(off[6:]).mean())),
        "camera_rad": float(np.linalg.norm(off[:3])),
        "camera_m": float(np.linalg.norm(off[3:6])),
        "left_out": result.left_out,
        "seconds": seconds,
    }


def _known(case: Case) -> Calibration:
    """The true offsets: no calibration does better."""
    recording = as_robot(_load(case.tests[0]), case.robot)
    robot = Robot.of(recording)
    true = true_offsets(case.robot, len(robot.joint_names), np.zeros(3))
    zeros = dict(zip(robot.joint_names, true[6:].tolist(), strict=True))
    return Calibration(robot, true[:6], np.zeros(3), zeros, EXACT**2 * np.eye(len(true)))


def _judged(
    case: Case, count: int | str, calibration: Calibration | None
) -> Iterator[dict[str, Any]]:
    for path in case.tests:
        recording = as_robot(_load(path), case.robot)
        frames = evaluation_frames(recording)
        for method in METHODS:
            errors, covered = _errors(recording, frames, method, calibration)
            yield {
                "robot has": "no error" if case.robot is None else "errors",
                "robot": case.robot,
                "recording": path.stem,
                "method": method,
                "grasps": count,
                "adds_m": float(np.median(errors)),
                "far": float((errors > FAR).mean()),
                "covered": covered,
            }


def _errors(
    recording: Recording,
    frames: Sequence[Measurement],
    method: Any,
    calibration: Calibration | None,
) -> tuple[np.ndarray, float]:
    """ADD-S [m] of frames after the turn, and the share of them within the 95 % region of their position."""
    config = EstimatorConfig(method=method)
    estimator = PoseEstimator(recording.hand, recording.object, config, calibration)
    estimates = [estimator.update(frame) for frame in frames]
    phases = turn_phases([frame.T_wh for frame in frames])
    chosen = [k for k, phase in enumerate(phases) if phase == AFTER][::EVERY]
    truths = recording.truth_at([frames[k].time for k in chosen])
    pairs = [
        (estimates[k], T_true)
        for k, T_true in zip(chosen, truths, strict=True)
        if T_true is not None and estimates[k].T_wo is not None
    ]
    relative = relative_poses([e.T_wo for e, _ in pairs], [T for _, T in pairs])
    inside = [_inside(e.T_wo.localCoordinates(T)[3:], e.covariance[3:, 3:]) for e, T in pairs]
    return _adds(recording.path).each(relative), float(np.mean(inside))


def _inside(off: np.ndarray, covariance: np.ndarray) -> bool:
    """Whether a position's error lies in the 95 % region; a region without end holds everything."""
    if not np.isfinite(covariance).all():
        return True
    return bool(off @ np.linalg.solve(covariance, off) < 7.815)  # chi-square, 3 degrees of freedom


@cache  # each process reads each recording once
def _load(path: Path) -> Recording:
    return read_recording(path)


@cache
def _adds(path: Path) -> Adds:
    return Adds(_load(path).object.mesh)


def _grouped(
    rows: Sequence[dict[str, Any]], *columns: str
) -> Iterator[tuple[tuple[Any, ...], list[dict[str, Any]]]]:
    """Rows by the values of some columns, in the order in which these come."""
    groups: dict[tuple[Any, ...], list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault(tuple(row[column] for column in columns), []).append(row)
    yield from sorted(groups.items(), key=lambda item: [str(part).zfill(20) for part in item[0]])


def _errors_row(has: str, method: str, grasps: Any, rows: list[dict[str, Any]]) -> dict[str, Any]:
    errors = 1e3 * np.array([row["adds_m"] for row in rows])
    return {
        "robot has": has,
        "method": method,
        "earlier grasps": str(grasps),
        "median": float(np.median(errors)),
        "90 %": float(np.quantile(errors, 0.9)),
        "worst": float(errors.max()),
        "frames > 5 mm [%]": 100 * float(np.mean([row["far"] for row in rows])),
        "in the 95 % region [%]": 100 * float(np.mean([row["covered"] for row in rows])),
        "recordings": len(rows),
    }


def _offsets_row(has: str, grasps: Any, rows: list[dict[str, Any]]) -> dict[str, Any]:
    def mean(name: str, scale: float = 1.0) -> float:
        return scale * float(np.sqrt(np.mean(np.square([row[name] for row in rows]))))

    return {
        "robot has": has,
        "grasps": str(grasps),
        "NEES": float(np.mean([row["nees"] for row in rows])),
        "largest NEES": float(np.max([row["nees"] for row in rows])),
        "joint zeros [deg]": mean("joints_rad", float(np.degrees(1.0))),
        "camera turn [deg]": mean("camera_rad", float(np.degrees(1.0))),
        "camera [mm]": mean("camera_m", 1e3),
        "left out": sum(len(row["left_out"]) for row in rows),
        "processor time [s]": float(np.median([row["seconds"] for row in rows])),
    }


def figure(rows: Sequence[dict[str, Any]]) -> Figure:
    """The error against the number of grasps: median and 90th percentile of each method."""
    from matplotlib.figure import Figure

    picture = Figure(figsize=(7, 4), layout="constrained")
    axes = picture.subplots()
    colors = dict(zip(METHODS, ("#999999", "#E69F00", "#0072B2"), strict=True))
    for method in METHODS:
        chosen = [row for row in rows if row["method"] == method and row["robot has"] == "errors"]
        points = [row for row in chosen if row["earlier grasps"] != LIMIT]
        counts = [int(row["earlier grasps"]) for row in points]
        color = colors[method]
        axes.plot(counts, [row["median"] for row in points], "o-", color=color, label=method)
        axes.plot(counts, [row["90 %"] for row in points], "--", color=color, linewidth=1)
        if method == METHODS[-1]:
            for row in chosen:
                if row["earlier grasps"] == LIMIT:
                    axes.axhline(row["median"], color="0.6", linestyle=":", label=LIMIT)
    axes.set_ylim(bottom=0)
    axes.set_xlabel("earlier grasps of the same robot")
    axes.set_ylabel("ADD-S after the turn [mm]")
    axes.legend(title="median; dashed: 90 %", fontsize=8)
    axes.spines[["top", "right"]].set_visible(False)
    return picture
