# SPDX-License-Identifier: MIT
"""Search for the settings of ``EstimatorConfig.tuned()``, on recordings that no result is reported on.

What is minimised is the mean over the recordings of the log of the mean ADD-S: a factor gained counts the
same whether vision is good or bad, and a lost object counts as ``WORST``.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from joblib import Parallel, delayed

from vtgtsam import EstimatorConfig, Measurement, PoseEstimator, read_recording
from vtgtsam.evaluation.find import find_recordings
from vtgtsam.metrics import Adds
from vtgtsam.objects import mesh_of
from vtgtsam.recording import Recording
from vtgtsam.recording.frames import evaluation_frames

from .report import save, table

if TYPE_CHECKING:
    import optuna
    from matplotlib.figure import Figure

WORST, BEST = 20e-3, 0.05e-3  # [m], larger and smaller mean errors count as these
EVERY = 10  # frames, of which one is compared with the truth
# Ranges searched: standard deviations [m] of touching pads and of penetration, and where a visual pose and a
# contact cease to count [sigma].
RANGES = {
    "tactile": (0.3e-3, 4e-3),
    "penetration": (0.2e-3, 2e-3),
    "visual_cut": (3.0, 30.0),
    "tactile_cut": (1.5, 15.0),
}


def run(recordings: Path, trials: int, jobs: int) -> None:
    """Search, and write ``tuning.md``, ``tuning.json`` and ``tuning.png``."""
    import optuna

    paths = list(find_recordings([recordings]).values())
    study = optuna.create_study(sampler=optuna.samplers.TPESampler(seed=0))
    study.enqueue_trial(settings_of(EstimatorConfig.tuned()))  # what is there is the one to beat
    with Parallel(jobs) as workers:
        study.optimize(lambda trial: _objective(trial, paths, workers), trials)
        compared = {
            "vision alone": EstimatorConfig.tuned(method="vis"),
            "the paper's losses, weights 1": EstimatorConfig.simulation(),
            "without contacts": EstimatorConfig.tuned(method="vis+pen"),
            "tuned()": EstimatorConfig.tuned(),
            "best found": config_of(study.best_params),
        }
        rows = [_row(name, _errors(config, paths, workers)) for name, config in compared.items()]
    best = table([_readable(study.best_params)])
    text = f"{len(paths)} recordings, {trials} trials.\n\n{table(rows)}\n\nBest found:\n\n{best}"
    data = {"rows": rows, "best": study.best_params, "trials": _trials(study)}
    save("tuning", text, data, {"tuning": figure(data["trials"])})


def config_of(settings: dict[str, float]) -> EstimatorConfig:
    """A configuration from what is searched for."""
    return EstimatorConfig.tuned(
        w_tac=settings["tactile"] ** -2,
        w_pen=settings["penetration"] ** -2,
        log_theta_vis=2.0 * math.log(settings["visual_cut"]),
        log_theta_tac=2.0 * math.log(settings["tactile_cut"]),
    )


def settings_of(config: EstimatorConfig) -> dict[str, float]:
    """What is searched for, as a configuration has it."""
    return {
        "tactile": config.w_tac**-0.5,
        "penetration": config.w_pen**-0.5,
        "visual_cut": math.exp(config.log_theta_vis / 2.0),
        "tactile_cut": math.exp(config.log_theta_tac / 2.0),
    }


def mean_error(path: Path, config: EstimatorConfig) -> float:
    """Mean ADD-S of one recording [m]; a frame without an estimate counts as ``WORST``."""
    recording, frames, adds = _load(path)
    estimator = PoseEstimator(recording.hand, recording.object, config)
    poses = [estimator.update(frame).T_wo for frame in frames][::EVERY]
    truths = recording.truth_at([frame.time for frame in frames[::EVERY]])
    errors = [
        WORST if T_est is None else min(adds(T_est, T_true), WORST)
        for T_est, T_true in zip(poses, truths, strict=True)
        if T_true is not None
    ]
    return float(np.mean(errors))


@cache  # each process reads each recording once
def _load(path: Path) -> tuple[Recording, list[Measurement], Adds]:
    recording = read_recording(path)
    return recording, evaluation_frames(recording), Adds(mesh_of(recording.object))


def _errors(config: EstimatorConfig, paths: Sequence[Path], workers: Parallel) -> np.ndarray:
    return np.array(workers(delayed(mean_error)(path, config) for path in paths))


def _objective(trial: optuna.Trial, paths: Sequence[Path], workers: Parallel) -> float:
    settings = {name: trial.suggest_float(name, *ends, log=True) for name, ends in RANGES.items()}
    errors = _errors(config_of(settings), paths, workers)
    return float(np.log(np.maximum(errors, BEST)).mean())


def _row(name: str, errors: np.ndarray) -> dict[str, Any]:
    median, worst = np.quantile(errors, (0.5, 0.9))
    return {
        "settings": name,
        "geometric mean [mm]": 1e3 * np.exp(np.log(np.maximum(errors, BEST)).mean()),
        "median [mm]": 1e3 * median,
        "90 % below [mm]": 1e3 * worst,
    }


def _readable(settings: dict[str, float]) -> dict[str, float]:
    return {
        "tactile sigma [mm]": 1e3 * settings["tactile"],
        "penetration sigma [mm]": 1e3 * settings["penetration"],
        "visual cut [sigma]": settings["visual_cut"],
        "tactile cut [sigma]": settings["tactile_cut"],
    }


def _trials(study: optuna.Study) -> list[dict[str, float]]:
    return [trial.params | {"log error": trial.value} for trial in study.trials]


def figure(trials: Sequence[dict[str, float]]) -> Figure:
    """The error over each setting, one dot a trial; the first trial has the settings of ``tuned()``."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import FixedLocator, NullLocator

    picture = Figure(figsize=(9, 2.8), layout="constrained")
    panels = picture.subplots(1, len(RANGES), sharey=True)
    errors = [1e3 * math.exp(trial["log error"]) for trial in trials]
    best = int(np.argmin(errors))
    for axes, (name, (low, high)) in zip(panels, RANGES.items(), strict=True):
        length = name in ("tactile", "penetration")
        values = [(1e3 if length else 1.0) * trial[name] for trial in trials]
        axes.plot(values, errors, "o", color="0.6", markersize=4)
        axes.plot(values[0], errors[0], "D", color="#0072B2", label="tuned()")
        axes.plot(values[best], errors[best], "*", color="#D55E00", markersize=12, label="best")
        axes.set_xscale("log")
        ends = np.array([low, high]) * (1e3 if length else 1.0)
        ticks = [*ends.round(3), np.sqrt(ends.prod()).round(1)]
        axes.xaxis.set_major_locator(FixedLocator(ticks))
        axes.xaxis.set_minor_locator(NullLocator())
        axes.xaxis.set_major_formatter("{x:g}")
        axes.set_xlabel(f"{name.replace('_', ' ')} [{'mm' if length else 'sigma'}]")
    panels[0].set_ylabel("ADD-S, geometric mean [mm]")
    panels[0].set_ylim(0.98 * min(errors), np.quantile(errors, 0.8))
    panels[-1].legend(fontsize=8, loc="upper left")
    return picture
