# SPDX-License-Identifier: MIT
"""Does a change of the code change a pose? Each frame solved again from a stored start, next to the stored pose.

Write the file with the code before the change, compare with the code after it. Settings are stored with the poses,
so that a change of the defaults does not count. A pose that moved is solved again from starts that differ in their last
bits: where these move it as far, only rounding has changed (a step that is taken or not by a hair, or a direction that
nothing holds).
"""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import gtsam
import numpy as np

from vtgtsam import EstimatorConfig, Measurement, PoseEstimator, read_recording
from vtgtsam.config import Solver
from vtgtsam.evaluation.find import find_recordings
from vtgtsam.recording.frames import evaluation_frames

from . import problems
from .ours import Ours

SOLVERS: tuple[Solver, ...] = ("lm", "fixed-damping")
SAME = 1e-6  # largest difference of an entry of a pose's matrix [1] or [m]
DRAWS = 20  # starts that differ in their last bits
FRAMES = 300  # of each benchmark problem

Case = tuple[str, PoseEstimator, list[Measurement]]


def run(stored: Path, recordings: Path | None = None) -> None:
    """Write ``stored`` where there is no such file, else compare with it.

    Raises:
        SystemExit: A pose differs.
    """
    if not stored.exists():
        write(stored, recordings)
    else:
        compare(stored, recordings)


def write(stored: Path, recordings: Path | None) -> None:
    """Track each case, and store where each frame started and ended."""
    arrays: dict[str, Any] = {}
    for name, estimator, frames in cases(recordings):
        starts, poses = track(estimator, frames)
        arrays |= {f"{name} starts": starts, f"{name} poses": poses}
        arrays[f"{name} settings"] = np.array(estimator.config.model_dump_json())
        print(f"{name}: {len(poses)} frames")
    np.savez_compressed(stored, **arrays)


def compare(stored: Path, recordings: Path | None) -> None:
    """Solve each frame from its stored start, and say how far it ends from the stored pose."""
    differs = False
    with np.load(stored, allow_pickle=False) as arrays:
        for name, estimator, frames in cases(recordings):
            if f"{name} poses" not in arrays:
                print(f"{name}: not in {stored}")
                continue
            settings = stored_settings(str(arrays[f"{name} settings"]))
            if settings != estimator.config:
                estimator = PoseEstimator(estimator.hand, estimator.obj, settings)
            poses = solve_each(estimator, frames, arrays[f"{name} starts"])
            apart = np.abs(poses - arrays[f"{name} poses"]).max(axis=(1, 2))
            moved = np.flatnonzero(~((apart <= SAME) | np.isnan(apart)))
            starts = arrays[f"{name} starts"]
            changed = [
                n
                for n in moved
                if apart[n] > 10 * rounding(estimator, frames[n], starts[n], poses[n])
            ]
            words = f", {len(moved) - len(changed)} frames by rounding" if len(moved) else ""
            words += f", frames {changed[:10]} otherwise" if changed else ""
            print(f"{name}: {len(poses)} frames, at most {np.nanmax(apart):.1e}{words}")
            differs |= len(changed) > 0
    if differs:
        raise SystemExit(f"poses differ by more than {SAME}")


def stored_settings(text: str) -> EstimatorConfig:
    """The settings that a file of any version names; those that are gone are left out."""
    stored = json.loads(text)
    known = {name: stored[name] for name in EstimatorConfig.model_fields if name in stored}
    return EstimatorConfig.simulation(**known)  # what a file does not name was as in the paper


def rounding(
    estimator: PoseEstimator, frame: Measurement, start: np.ndarray, pose: np.ndarray
) -> float:
    """How far a frame's pose moves if its start (4, 4) is changed in the last bits."""
    rng, starts = np.random.default_rng(0), np.tile(start, (DRAWS, 1, 1))
    starts[:, :3, 3] *= 1 + rng.integers(-2, 3, (DRAWS, 3)) * np.finfo(float).eps
    return float(np.abs(solve_each(estimator, [frame] * DRAWS, starts) - pose).max())


def cases(recordings: Path | None) -> Iterator[Case]:
    """The benchmark problems and the recordings, each with both solvers, and what is compared."""
    for title, problem in (
        ("unrelated", problems.single_frames(FRAMES)),
        ("tracked", problems.sequence(FRAMES)),
        ("built-in hand", problems.sequence(FRAMES, pads=problems.isyhand_pads())),
    ):
        for solver in SOLVERS:
            ours = Ours(problem, solver)
            yield f"{title}, {solver}", ours.estimator, ours.measurements
    if recordings is None:
        return
    for name, path in find_recordings([recordings]).items():
        recording = read_recording(path)
        frames = evaluation_frames(recording)
        for preset in (EstimatorConfig.simulation, EstimatorConfig.tuned):
            for solver in SOLVERS:
                settings = preset(solver=solver)
                estimator = PoseEstimator(recording.hand, recording.object, settings)
                yield f"{name}, {preset.__name__}, {solver}", estimator, frames


def track(estimator: PoseEstimator, frames: list[Measurement]) -> tuple[np.ndarray, np.ndarray]:
    """Starts and poses (N, 4, 4) of frames that follow each other; NaN where there is none."""
    starts, poses, T_wo = [], [], None
    for frame in frames:
        start = frame.T_wo_visual if T_wo is None else T_wo
        T_wo = estimator.update(frame).T_wo
        starts.append(_matrix(start))
        poses.append(_matrix(T_wo))
    return np.array(starts), np.array(poses)


def solve_each(
    estimator: PoseEstimator, frames: list[Measurement], starts: np.ndarray
) -> np.ndarray:
    """Poses (N, 4, 4), each frame from its own start."""
    poses = []
    for frame, start in zip(frames, starts, strict=True):
        estimator.reset(None if np.isnan(start).any() else gtsam.Pose3(start))
        poses.append(_matrix(estimator.update(frame).T_wo))
    return np.array(poses)


def _matrix(T_wo: gtsam.Pose3 | None) -> np.ndarray:
    return np.full((4, 4), np.nan) if T_wo is None else T_wo.matrix()
