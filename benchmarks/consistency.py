# SPDX-License-Identifier: MIT
"""Whether poses are as uncertain as their covariances say: the tracker's and the estimator's.

For a pose with error e (a twist, six numbers) and covariance S, e^T S^-1 e / 6 is 1 on average if the covariance is
right (NEES, normalised estimation error squared), more if it is too sure of itself, less if it is too careful. A turn
that the object's symmetry hides counts as an error too; the covariance of such a turn is large.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gtsam
import numpy as np

from vtgtsam import EstimatorConfig, Measurement, PoseEstimator, read_recording
from vtgtsam.evaluation.find import find_recordings
from vtgtsam.evaluation.phases import AFTER, BEFORE, phases_of
from vtgtsam.recording.frames import evaluation_frames

from .report import save, table

if TYPE_CHECKING:
    from vtgtsam.recording import Recording

SHARES = (0.1, 0.5, 0.9)  # of the recordings


def run(recordings: Path) -> None:
    """Measure, and write ``consistency.md`` and ``consistency.json``."""
    paths = list(find_recordings([recordings]).values())
    found: dict[tuple[str, str], list[float]] = {}
    for path in paths:
        recording = read_recording(path)
        frames = evaluation_frames(recording)
        phases = phases_of(frames)
        for what, values in (
            ("visual pose", visual(recording, frames)),
            ("estimate", estimated(recording, frames)),
        ):
            for phase in (BEFORE, AFTER):
                chosen = values[(np.array(phases) == phase) & np.isfinite(values)]
                if len(chosen):
                    found.setdefault((what, phase), []).append(float(chosen.mean()))
    rows = [_row(what, phase, values) for (what, phase), values in found.items()]
    text = f"{len(paths)} recordings; mean of e'S^-1e / 6 over each one's frames.\n\n{table(rows)}"
    save("consistency", text, {"rows": rows}, {})


def nees(T_est: gtsam.Pose3, covariance: np.ndarray, T_true: gtsam.Pose3) -> float:
    """Squared error in units of its covariance, per dimension; NaN where that is not finite."""
    if not np.isfinite(covariance).all():
        return float("nan")
    error = T_est.localCoordinates(T_true)
    return float(error @ np.linalg.solve(covariance, error)) / len(error)


def visual(recording: Recording, frames: Sequence[Measurement]) -> np.ndarray:
    """Of the visual pose of each frame; NaN where it has none, or no covariance."""
    truths = recording.truth_at([frame.time for frame in frames])
    return np.array(
        [
            nees(frame.T_wo_visual, frame.visual_covariance, T_true)
            if frame.T_wo_visual is not None
            and frame.visual_covariance is not None
            and T_true is not None
            else np.nan
            for frame, T_true in zip(frames, truths, strict=True)
        ]
    )


def estimated(recording: Recording, frames: Sequence[Measurement]) -> np.ndarray:
    """Of each frame's estimate with the settings of ``tuned()``."""
    estimator = PoseEstimator(recording.hand, recording.object, EstimatorConfig.tuned())
    estimates = [estimator.update(frame) for frame in frames]
    truths = recording.truth_at([frame.time for frame in frames])
    return np.array(
        [
            nees(estimate.T_wo, estimate.covariance, T_true)
            if estimate.T_wo is not None and T_true is not None
            else np.nan
            for estimate, T_true in zip(estimates, truths, strict=True)
        ]
    )


def _row(what: str, phase: str, values: Sequence[float]) -> dict[str, Any]:
    quantiles = np.quantile(values, SHARES)
    return {
        "pose": what,
        "turn": phase,
        "recordings": len(values),
        **{f"{share:.0%} below": value for share, value in zip(SHARES, quantiles, strict=True)},
    }
