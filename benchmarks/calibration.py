# SPDX-License-Identifier: MIT
"""What a robot gains from calibrating itself, by how many grasps it has made before.

Each robot has its own camera error and joint zeros (as ``python -m sim generate --robot`` draws them), makes its
earlier grasps in an order of its own, and is judged on grasps that were not among them: ADD-S after the hand's turn.
"""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from vtgtsam import Calibration, EstimatorConfig, Measurement, PoseEstimator, read_recording
from vtgtsam.atomic import write_text
from vtgtsam.calibration.calibrate import run as calibrate
from vtgtsam.calibration.online import OnlineCalibration
from vtgtsam.calibration.robot import Robot
from vtgtsam.evaluation.engine import run_tasks
from vtgtsam.evaluation.find import find_recordings
from vtgtsam.evaluation.phases import AFTER, phases_of
from vtgtsam.exceptions import CalibrationError, RecordingError
from vtgtsam.metrics import Adds, relative_poses
from vtgtsam.objects import mesh_of
from vtgtsam.recording import Recording
from vtgtsam.recording.frames import evaluation_frames

from .calibration_report import LIMIT, ONLINE, figure, tables
from .imposed import as_robot, misled, true_offsets
from .report import RESULTS, save

FIRST_ROBOT = 5000  # lower numbers are for choosing settings
EVERY = 5  # frames, of which one is compared with the truth
FAR = 5e-3  # [m], an error above is a lost object
PARTS = RESULTS / "calibration.parts.json"  # what is done of an unfinished run
EXACT = 1e-6  # standard deviation of offsets that are given, rad and m


class Case(NamedTuple):
    """One robot, and what it did before.

    Attributes:
        robot: Its number; None: one without error.
        earlier: Recordings of its earlier grasps, in their order.
        tests: Recordings that it is judged on.
        counts: Numbers of earlier grasps to calibrate from.
        methods: What is judged.
        plain: What is judged without a calibration alone, besides.
        imposed: Whether the recordings get its errors; otherwise they have them.
        online: Whether calibrating while it works is judged.
        misled: How far the tracker is off on each object [m].
    """

    robot: int | None
    earlier: tuple[Path, ...]
    tests: tuple[Path, ...]
    counts: tuple[int, ...]
    methods: tuple[str, ...]
    plain: tuple[str, ...]
    imposed: bool
    online: bool
    misled: float = 0.0

    def load(self, path: Path) -> Recording:
        """A recording of this robot's."""
        recording = as_robot(_load(path), self.robot) if self.imposed else _load(path)
        return misled(recording, self.misled) if self.misled else recording


def run(
    recordings: Path,
    robots: int,
    tests: int,
    counts: Sequence[int],
    methods: Sequence[str],
    plain: Sequence[str],
    jobs: int,
    recorded: bool = False,
    online: bool = True,
    off: float = 0.0,
) -> None:
    """Measure, and write ``calibration.md``, ``calibration.json`` and ``calibration.png``.

    Interrupted, it goes on where it stopped when called again with the same arguments.

    Args:
        recordings: Folder of simulated recordings with truth.
        robots: How many robots to make of them.
        tests: How many grasps each is judged on.
        counts: Numbers of earlier grasps to calibrate from.
        methods: What is judged.
        plain: What is judged without a calibration alone, besides.
        jobs: Processes to use.
        recorded: Whether to judge the robots that made the recordings instead.
        online: Whether to judge calibrating while it works.
        off: How far the tracker is off in a direction of each object's own [m].
    """
    paths = list(find_recordings([recordings]).values())
    make = _recorded if recorded else partial(_imposed, robots=robots)
    judged: dict[str, Any] = {
        "counts": counts,
        "methods": tuple(methods),
        "plain": tuple(plain),
        "online": online,
    }
    cases = [case._replace(misled=off) for case in make(paths, tests=tests, **judged)]
    about = [
        str(recordings.resolve()),
        len(paths),
        tests,
        list(counts),
        list(methods),
        list(plain),
        recorded,
        online,
        off,
    ]
    found = _done(about)
    missing = [case for case in cases if str(case.robot) not in found]
    for rows in run_tasks(judge, missing, jobs):
        found[str(rows[0]["robot"])] = rows
        RESULTS.mkdir(parents=True, exist_ok=True)
        write_text(PARTS, json.dumps({"about": about, "robots": found}))
        print(f"{len(found)} of {len(cases)} robots", flush=True)
    rows = [row for case in cases for row in found[str(case.robot)]]
    errors, text = tables(rows)
    text = (
        f"{len(cases)} robots, {tests} grasps each to judge them by, of {len(paths)} recordings. "
        f"ADD-S [mm] after the turn, median of each recording.\n\n{text}"
    )
    save("calibration", text, {"rows": rows}, {"calibration": figure(errors)})


def _done(about: list[Any]) -> dict[str, list[dict[str, Any]]]:
    """The rows of robots that were judged before, by the robot."""
    if not PARTS.is_file():
        return {}
    known = json.loads(PARTS.read_text())
    return dict(known["robots"]) if known["about"] == about else {}


def _imposed(paths: Sequence[Path], robots: int, tests: int, **judged: Any) -> Iterator[Case]:
    """Robots with errors of their own, all of the same grasps, and one without error last."""
    for n in range(robots + 1):
        order = np.random.default_rng(n).permutation(len(paths)).tolist()
        robot = FIRST_ROBOT + n if n < robots else None
        yield _case(robot, [paths[i] for i in order], tests, imposed=True, **judged)


def _recorded(paths: Sequence[Path], tests: int, **judged: Any) -> Iterator[Case]:
    """The robots that made the recordings."""
    made: dict[str, list[Path]] = {}
    for path in paths:
        made.setdefault(_load(path).info.get("robot", ""), []).append(path)
    for name, own in sorted(made.items()):
        if not name.isdigit():
            raise RecordingError(f"{own[0]} is of no robot with a number (sim generate --robot N)")
        order = np.random.default_rng(int(name)).permutation(len(own)).tolist()
        yield _case(int(name), [own[i] for i in order], tests, imposed=False, **judged)


def _case(
    robot: int | None,
    paths: Sequence[Path],
    tests: int,
    counts: Sequence[int],
    methods: tuple[str, ...],
    plain: tuple[str, ...],
    imposed: bool,
    online: bool,
) -> Case:
    """A robot that is judged on the first of its recordings."""
    earlier = tuple(paths[tests:])
    usable = tuple(count for count in counts if count <= len(earlier))
    return Case(robot, earlier, tuple(paths[:tests]), usable, methods, plain, imposed, online)


def judge(case: Case) -> list[dict[str, Any]]:
    """A row for each number of grasps, method and test recording."""
    rows: list[dict[str, Any]] = []
    judged = partial(_judged, case)
    for count in case.counts:
        calibration: Calibration | None = None
        about: dict[str, Any] = {}
        if count:
            calibration, about = _calibrated(case, count)
        for row in judged(count, calibration):
            rows.append(row | about)
            about = {}
    if case.online:
        rows += judged(ONLINE, None)
    if case.robot is not None:
        rows += judged(LIMIT, _known(case))
    return rows


def _calibrated(case: Case, count: int) -> tuple[Calibration | None, dict[str, Any]]:
    """A calibration from the first ``count`` grasps, and how good it is; None where none of them is of use."""
    earlier = [case.load(path) for path in case.earlier[:count]]
    start = time.process_time()
    try:
        result = calibrate(earlier)
    except CalibrationError as error:
        return None, {"refused": str(error)}
    seconds = time.process_time() - start
    calibration = result.calibration
    true = true_offsets(case.robot, len(calibration.joint_names), calibration.camera_origin)
    off = calibration.offsets - true
    return calibration, {
        "nees": float(off @ np.linalg.solve(calibration.covariance, off)) / len(off),
        "joints_rad": float(np.sqrt(np.square(off[6:]).mean())),
        "camera_rad": float(np.linalg.norm(off[:3])),
        "camera_m": float(np.linalg.norm(off[3:6])),
        "left_out": {Path(name).stem: why for name, why in result.left_out.items()},
        "seconds": seconds,
    }


def _known(case: Case) -> Calibration:
    """The true offsets: no calibration does better."""
    recording = case.load(case.tests[0])
    robot = Robot.of(recording)
    true = true_offsets(case.robot, len(robot.joint_names), np.zeros(3))
    zeros = dict(zip(robot.joint_names, true[6:].tolist(), strict=True))
    return Calibration(robot, true[:6], np.zeros(3), zeros, EXACT**2 * np.eye(len(true)))


def _judged(
    case: Case, count: int | str, calibration: Calibration | None
) -> Iterator[dict[str, Any]]:
    for path in case.tests:
        recording = case.load(path)
        frames = evaluation_frames(recording)
        for method in (*case.methods, *(case.plain if count == 0 else ())):
            if count == ONLINE and not method.endswith("+mem"):
                continue
            errors, covered = _errors(
                recording, frames, method, calibration, online=count == ONLINE
            )
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
    online: bool = False,
) -> tuple[np.ndarray, float]:
    """ADD-S [m] of frames after the turn, and the share of them within the 95 % region of their position."""
    config = EstimatorConfig(method=method)
    hand, obj = recording.hand, recording.object
    estimator: PoseEstimator | OnlineCalibration
    if online:
        estimator = OnlineCalibration(hand, obj, config, calibration, background=False)
    else:
        estimator = PoseEstimator(hand, obj, config, calibration)
    estimates = [estimator.update(frame) for frame in frames]
    phases = phases_of(frames)
    chosen = [k for k, phase in enumerate(phases) if phase == AFTER][::EVERY]
    truths = recording.truth_at([frames[k].time for k in chosen])
    pairs = [
        (T_wo, T_true, estimates[k].covariance)
        for k, T_true in zip(chosen, truths, strict=True)
        if T_true is not None and (T_wo := estimates[k].T_wo) is not None
    ]
    relative = relative_poses([T_wo for T_wo, _, _ in pairs], [T_true for _, T_true, _ in pairs])
    inside = [
        _inside(T_wo.localCoordinates(T_true)[3:], covariance[3:, 3:])
        for T_wo, T_true, covariance in pairs
    ]
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
    return Adds(mesh_of(_load(path).object))
