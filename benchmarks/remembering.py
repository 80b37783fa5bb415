# SPDX-License-Identifier: MIT
"""What memory costs: a frame with it next to one without, on a recorded grasp, and whether the process grows.

The estimators take turns in short blocks over the same frames, each from where it was; times are running times of the
thread. Then the grasp is repeated with memory, and the process's size is read.
"""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import Any

import numpy as np

from vtgtsam import EstimatorConfig, Measurement, PoseEstimator

from .clock import pin, timed
from .replay import FRAME_ALONE, MEMORY, Replay, estimator, load
from .report import save, table
from .soak import memory_mb, without_huge_pages

BLOCK = 20  # frames
ROUNDS = 3  # times through the recording, of which the first is not counted
SAMPLES = 10  # times that the process's size is read

EXACT: dict[str, Any] = {"joint_sigma": 0.0, "camera_sigma": (0.0, 0.0)}
COMPARED = {
    "a frame alone, exact robot": EstimatorConfig.tuned(method="vis+tac+pen", **EXACT),
    "a frame alone, uncertain joints and camera": FRAME_ALONE,
    "memory, exact robot": EstimatorConfig.tuned(**EXACT),
    "memory, uncertain joints and camera": MEMORY,
}


def run(recording: Path, frames: int) -> None:
    """Measure, and write ``remembering.md`` and ``remembering.json``."""
    pin()
    without_huge_pages()
    replay = load(recording)
    rows = compared(replay)
    sizes = repeated(replay, frames)
    grown = sizes[-1]["memory [MB]"] - sizes[1]["memory [MB]"]
    text = (
        f"{len(replay.frames)} frames of {replay.recording.object.name}, {ROUNDS - 1} times, in blocks of {BLOCK}.\n\n"
        f"{table(rows)}\n\n{frames:,} frames with memory in one process: from frame {sizes[1]['frame']:,} on it "
        f"grew by {grown:.1f} MB.\n\n{table(sizes)}"
    )
    save("remembering", text, {"rows": rows, "sizes": sizes}, {})


def compared(replay: Replay) -> list[dict[str, Any]]:
    """Time of a frame of each, and the ratio to the first one's of blocks' medians, and of the means of all frames."""
    estimators = {name: estimator(replay, config) for name, config in COMPARED.items()}
    blocks: dict[str, list[float]] = {name: [] for name in COMPARED}
    means: dict[str, list[float]] = {name: [] for name in COMPARED}
    for turn in range(ROUNDS):
        for of in estimators.values():
            of.reset()
        for begin in range(0, len(replay.frames), BLOCK):
            for name, of in estimators.items():
                times = [_time(of, frame) for frame in replay.frames[begin : begin + BLOCK]]
                if turn:
                    blocks[name].append(float(np.median(times)))
                    means[name].append(float(np.mean(times)))
    first = np.array(next(iter(blocks.values())))
    first_mean = float(np.mean(next(iter(means.values()))))
    return [
        {
            "frame": name,
            "median [ms]": 1e3 * float(np.median(times)),
            "times the first": float(np.median(np.array(times) / first)),
            "mean [ms]": 1e3 * float(np.mean(means[name])),
            "times the first's mean": float(np.mean(means[name])) / first_mean,
        }
        for name, times in blocks.items()
    ]


def repeated(replay: Replay, frames: int) -> list[dict[str, Any]]:
    """The process's size while a grasp is estimated again and again with memory."""
    of, every, found = estimator(replay, MEMORY), max(1, frames // SAMPLES), []
    period = replay.frames[-1].time - replay.frames[0].time + 1.0
    for n in range(frames):
        lap, k = divmod(n, len(replay.frames))
        if k == 0:
            of.reset()
        frame = replay.frames[k]
        of.update(dataclasses.replace(frame, time=frame.time + lap * period))
        if (n + 1) % every == 0:
            found.append({"frame": n + 1, "memory [MB]": memory_mb()})
    return found


def _time(of: PoseEstimator, frame: Measurement) -> float:
    return timed(lambda: of.update(frame))[0].cpu
