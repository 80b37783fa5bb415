# SPDX-License-Identifier: MIT
"""Memory's settings one at a time, halved and doubled, on recordings that no result is reported on.

A recording's error is the mean ADD-S of its frames, and that of the frames in which vision is silent, flipped or off.
What is compared is the geometric mean over the recordings of a folder: a factor gained counts the same whether vision
is good or bad, and a lost object counts as ``WORST``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from joblib import Parallel, delayed

from vtgtsam import EstimatorConfig, PoseEstimator
from vtgtsam.config import ModeSettings

from .disturbances import BEGIN, flipped, off, silent
from .replay import (
    MEMORY,
    Replay,
    below,
    consistency,
    copied,
    errors_mm,
    estimator,
    load,
)
from .replay import run as replayed
from .report import save, table

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WORST_MM, BEST_MM, LARGE_MM = 20.0, 0.05, 5.0
WRONG = "something wrong"  # the disturbed frames of all recordings
FACTORS = {"half": 0.5, "double": 2.0}
MODES = ("free", "moving", "held")
NUMBERS = ("held_speed", "refused_weight", "restart_after", "offsets_correlation")
RECOMMENDED = "recommended"


class Judged(NamedTuple):
    """How a recording comes out with some settings.

    Attributes:
        error: Mean ADD-S [mm].
        large: Share of frames above ``LARGE_MM``.
        inside: Share of frames whose 95 % region holds the truth.
        wrong: Mean ADD-S of the frames in which vision is silent, flipped or off [mm].
    """

    error: float
    large: float
    inside: float
    wrong: float


def run(folders: Sequence[Path], jobs: int) -> None:
    """Compare, and write ``memory_settings.md``, ``memory_settings.json`` and ``memory_settings.png``."""
    labelled = [(folder.name, path) for folder in folders for path in below([folder])]
    found = Parallel(jobs, verbose=1)(delayed(judge)(path) for _, path in labelled)
    rows = [_row(name, labelled, found) for name in variants()]
    words = (
        f"{len(labelled)} recordings. Geometric means over a folder's recordings of their mean ADD-S [mm]; "
        f"frames above {LARGE_MM:g} mm and inside the 95 % regions of all."
    )
    save(
        "memory_settings",
        f"{words}\n\n{table(rows)}",
        {"rows": rows},
        {"memory_settings": figure(rows)},
    )


def variants() -> dict[str, EstimatorConfig]:
    """The recommended settings, and those with one of memory's halved or doubled, by name."""
    made = {RECOMMENDED: MEMORY}
    for word, factor in FACTORS.items():
        for mode in MODES:
            settings: ModeSettings = getattr(MEMORY, mode)
            walk = ModeSettings(
                settings.rotation * factor, settings.translation * factor, settings.correlation
            )
            made[f"{mode} walk, {word}"] = _tuned(mode, walk)
            if settings.correlation > 0.0:
                longer = settings._replace(correlation=settings.correlation * factor)
                made[f"{mode} correlation, {word}"] = _tuned(mode, longer)
        theta = MEMORY.log_theta_vis_mem + math.log(factor)
        made[f"theta_vis_mem, {word}"] = _tuned("log_theta_vis_mem", theta)
        for name in NUMBERS:
            made[f"{name}, {word}"] = _tuned(name, getattr(MEMORY, name) * factor)
    return dict(sorted(made.items(), key=lambda item: item[0] != RECOMMENDED))


def _tuned(name: str, value: Any) -> EstimatorConfig:
    """The recommended settings with one of them changed."""
    return EstimatorConfig.tuned(**{name: value})


def judge(path: Path) -> dict[str, Judged]:
    """How a recording comes out with each of the settings."""
    replay = load(path)
    return {name: _judged(replay, config) for name, config in variants().items()}


def _judged(replay: Replay, config: EstimatorConfig) -> Judged:
    starting = estimator(replay, config)
    early = int(np.searchsorted(replay.times, BEGIN))
    estimates = replayed(starting, replay.frames[:early])
    until_then = copied(starting)
    estimates += replayed(starting, replay.frames[early:])
    errors = errors_mm(replay.adds, estimates, replay.truths)
    return Judged(
        error=_mean(errors),
        large=float(np.mean(errors > LARGE_MM)),
        inside=float(consistency(replay, estimates).inside.mean()),
        wrong=_mean(_errors_disturbed(replay, until_then, early)),
    )


def _errors_disturbed(replay: Replay, until_then: PoseEstimator, early: int) -> np.ndarray:
    """ADD-S [mm] of the frames in which vision is silent, flipped or off, and of half a second afterwards.

    Args:
        replay: The recording.
        until_then: An estimator that has seen the frames before.
        early: How many these are.
    """
    found = []
    for disturb in (silent, flipped, off):
        disturbed = disturb(replay)
        chosen = np.flatnonzero(disturbed.judged)
        frames = disturbed.frames[early : chosen[-1] + 1]
        estimates = replayed(copied(until_then), frames)
        truths = [disturbed.truths[n] for n in chosen]
        found.append(errors_mm(replay.adds, [estimates[n - early] for n in chosen], truths))
    return np.concatenate(found)


def _mean(errors_mm: np.ndarray) -> float:
    return float(np.clip(np.minimum(errors_mm, WORST_MM).mean(), BEST_MM, None))


def _row(
    name: str, labelled: Sequence[tuple[str, Path]], found: Sequence[dict[str, Judged]]
) -> dict[str, Any]:
    judged = [of_recording[name] for of_recording in found]
    row: dict[str, Any] = {"settings": name}
    for label in dict.fromkeys(label for label, _ in labelled):
        errors = [j.error for j, (of, _) in zip(judged, labelled, strict=True) if of == label]
        row[label] = _geometric(errors)
    row["all"] = _geometric([j.error for j in judged])
    row[WRONG] = _geometric([j.wrong for j in judged])
    row[f"above {LARGE_MM:g} mm [%]"] = 1e2 * float(np.mean([j.large for j in judged]))
    row["inside 95 % [%]"] = 1e2 * float(np.mean([j.inside for j in judged]))
    return row


def _geometric(errors: Sequence[float]) -> float:
    return float(np.exp(np.log(errors).mean()))


def figure(rows: Sequence[dict[str, Any]]) -> Figure:
    """Each change's error over the recommended settings' error, of all frames and of those where something is wrong."""
    from matplotlib.figure import Figure

    picture = Figure(figsize=(6.4, 0.22 * len(rows) + 1.0), layout="constrained")
    axes = picture.subplots()
    names = [row["settings"] for row in rows[1:]]
    for label, marker in (("all", "o"), (WRONG, "x")):
        ratios = [row[label] / rows[0][label] for row in rows[1:]]
        axes.plot(ratios, names, marker, label="all frames" if label == "all" else label)
    axes.axvline(1.0, color="black", linestyle=":", linewidth=1)
    axes.set(xscale="log", xlabel="mean ADD-S, times that of the recommended settings")
    axes.set_xticks([0.8, 0.9, 1.0, 1.1, 1.25, 1.5, 2.0], labels=None)
    axes.xaxis.set_major_formatter("{x:g}")
    axes.xaxis.minorticks_off()
    axes.invert_yaxis()
    axes.grid(alpha=0.3)
    axes.legend(fontsize="small")
    return picture
