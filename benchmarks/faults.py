# SPDX-License-Identifier: MIT
"""Whether failing sensors are named, how soon, and what they do to the pose; and false alarms where nothing is spoiled.

The pose with a fault is compared with the better of two that it cannot spoil: vision alone, and memory with touch but
without vision from the fault's begin on, both from the same faulty streams.

In a grasp that nobody spoils the tracker may lose the object by itself. So an alarm there is judged by the truth: it is
right in a frame whose visual pose is off by more than 5 mm, and false in any other.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from joblib import Parallel, delayed

from vtgtsam import Estimate, EstimatorConfig, Measurement, PoseEstimator

from .replay import MEMORY, VIS, Replay, below, copied, errors_mm, estimator, load
from .replay import run as replayed
from .report import save, table
from .sensor_faults import BEGIN, FAULTS, SensorFault, blind, first_frame, names, wrong_object

SOON = 0.5  # [s], after it could be seen
OFF_MM = 5.0  # a visual pose this far from the truth, by its position or by ADD-S, is an error that may be named
ALLOWED_MM = 2.0  # worse than the better of vision alone and touch alone


def run(folders: Sequence[Path], clean: Sequence[Path], jobs: int) -> None:
    """Measure, and write ``faults.md`` and ``faults.json``.

    Args:
        folders: Recordings that are spoiled.
        clean: Further recordings, in which nothing should be named.
        jobs: Processes to use.
    """
    paths = below(folders)
    spoiled = Parallel(jobs)(delayed(of_recording)(path) for path in paths)
    found = [result for results in spoiled for result in results]
    rows = [_row(name, [r for r in found if r["fault"] == name]) for name in FAULTS]
    every = below([*folders, *clean])
    alarms = Parallel(jobs)(delayed(alarms_in)(path) for path in every)
    shown = [_alarm_row(alarm) for of in alarms for alarm in of]
    text = (
        f"{len(paths)} recordings, from {BEGIN:g} s on. ADD-S [mm]: medians of the frames that follow."
        f"\n\n{table(rows)}\n\n{_alarm_words(alarms)}" + (f"\n\n{table(shown)}" if shown else "")
    )
    save("faults", text, {"rows": rows, "each": found, "alarms": shown}, {})


def of_recording(path: Path) -> list[dict[str, Any]]:
    """What each fault does in one recording."""
    replay = load(path)
    middle = first_frame(replay)
    before: dict[str, PoseEstimator] = {
        config.method: estimator(replay, config) for config in (MEMORY, VIS)
    }
    for half in before.values():
        replayed(half, replay.frames[:middle])
    return [
        {"fault": name, "recording": path.stem, "condition": replay.condition}
        | _result(replay, fault, before)
        for name, fault in FAULTS.items()
    ]


def _result(replay: Replay, fault: SensorFault, before: dict[str, PoseEstimator]) -> dict[str, Any]:
    frames = fault.frames(replay)
    estimates = _after(replay, fault, before, MEMORY, frames)
    vision = _after(replay, fault, before, VIS, frames)
    touch = _after(replay, fault, before, MEMORY, blind(frames))
    errors = {
        name: _median_mm(replay, of)
        for name, of in (("pose", estimates), ("vision alone", vision), ("without vision", touch))
    }
    return {
        **errors,
        "worse": errors["pose"] - min(errors["vision alone"], errors["without vision"]),
        **_naming(replay, fault, estimates),
    }


def _after(
    replay: Replay,
    fault: SensorFault,
    before: dict[str, PoseEstimator],
    config: EstimatorConfig,
    frames: Sequence[Measurement],
) -> list[Estimate]:
    """The estimates from the fault's begin on; all of them where the object was another one from the start."""
    if fault.stream == "object":
        of = PoseEstimator(replay.recording.hand, wrong_object(replay), config)
        return replayed(of, frames)
    return replayed(copied(before[config.method]), frames[first_frame(replay) :])


def _median_mm(replay: Replay, estimates: Sequence[Estimate]) -> float:
    last = [e for e in estimates if e.time >= BEGIN]
    errors = errors_mm(replay.adds, last, replay.truths[-len(last) :])
    return float(np.median(errors))


def _naming(replay: Replay, fault: SensorFault, estimates: Sequence[Estimate]) -> dict[str, Any]:
    """When it is named after it could be seen, and in which words anything is."""
    shows = fault.shows(replay)
    times = [e.time for e in estimates if names(fault, e.faults)]
    said = Counter(word for e in estimates for word in e.faults)
    status = Counter(e.status for e in estimates)
    return {
        "shows": shows,
        "delay": None if shows is None or not times else times[0] - shows,
        "said": dict(said.most_common(4)),
        "status": dict(status.most_common(3)),
    }


def _row(name: str, results: Sequence[dict[str, Any]]) -> dict[str, Any]:
    shown = [r for r in results if r["shows"] is not None]
    delays = [r["delay"] for r in shown if r["delay"] is not None]
    soon = sum(delay <= SOON for delay in delays)
    return {
        "fault": name,
        "named": f"{len(delays)} of {len(shown)}",
        f"within {SOON:g} s": f"{soon} of {len(shown)}",
        "slowest [s]": max(delays, default=None),
        **{
            f"{what} [mm]": float(np.median([r[what] for r in results]))
            for what in ("pose", "vision alone", "without vision")
        },
        "worse by, at most [mm]": max(r["worse"] for r in results),
        f"worse by at most {ALLOWED_MM:g} mm": f"{sum(r['worse'] <= ALLOWED_MM for r in results)} of {len(results)}",
    }


class Alarm(NamedTuple):
    """What is named in a recording that nobody spoiled.

    Attributes:
        recording: Which.
        named: A fault, or a bad status.
        frames: In how many frames.
        false: In how many of them the visual pose is right, or there is none.
        vision_mm: ADD-S of the visual poses in these frames [mm], median; NaN where there is none.
    """

    recording: str
    named: str
    frames: int
    false: int
    vision_mm: float


def alarms_in(path: Path) -> list[Alarm]:
    """What is named in a recording that nobody spoiled, each fault and each bad status."""
    replay = load(path)
    estimates = replayed(estimator(replay), replay.frames)
    where: dict[str, list[int]] = {}
    for n, estimate in enumerate(estimates):
        bad = estimate.status in ("contradicted", "lost")
        for word in (*estimate.faults, *([f"status {estimate.status}"] if bad else [])):
            where.setdefault(word, []).append(n)
    name = str(Path(*path.parts[-4:]))
    return [Alarm(name, word, len(ns), *_judged(replay, ns)) for word, ns in where.items()]


def _judged(replay: Replay, frames: Sequence[int]) -> tuple[int, float]:
    """In how many of some frames nothing is wrong with the visual pose, and its median error [mm]."""
    adds, apart = np.array([_vision_mm(replay, n) for n in frames]).T
    wrong = np.fmax(adds, apart) > OFF_MM
    known = adds[np.isfinite(adds)]
    return int((~wrong).sum()), float(np.median(known)) if len(known) else float("nan")


def _vision_mm(replay: Replay, n: int) -> tuple[float, float]:
    """ADD-S and error of the position of a frame's visual pose [mm]; NaN where there is none."""
    T_wo, T_true = replay.frames[n].T_wo_visual, replay.truths[n]
    if T_wo is None:
        return float("nan"), float("nan")
    apart = np.linalg.norm(T_wo.translation() - T_true.translation())
    return 1e3 * replay.adds(T_wo, T_true), 1e3 * float(apart)


def _alarm_row(alarm: Alarm) -> dict[str, Any]:
    return {
        "recording": alarm.recording,
        "named": alarm.named,
        "frames": alarm.frames,
        "false in": alarm.false,
        "vision's error [mm]": None if np.isnan(alarm.vision_mm) else alarm.vision_mm,
    }


def _alarm_words(alarms: Sequence[Sequence[Alarm]]) -> str:
    faults = [[a for a in of if not a.named.startswith("status")] for of in alarms]
    status = [[a for a in of if a.named.startswith("status")] for of in alarms]
    return (
        f"Nothing is spoiled in {len(alarms)} recordings. A fault is named in {_count(faults)}; the status is "
        f"contradicted or lost in {_count(status)}. An alarm is false in a frame whose visual pose is at most "
        f"{OFF_MM:g} mm off, or that has none."
    )


def _count(alarms: Sequence[Sequence[Alarm]]) -> str:
    named = sum(bool(of) for of in alarms)
    false = sum(any(a.false for a in of) for of in alarms)
    return f"{named}, falsely in {false}"
