# SPDX-License-Identifier: MIT
"""A recording with truth, replayed frame by frame, with or without something wrong in its streams."""

from __future__ import annotations

import copy
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import gtsam
import numpy as np

from vtgtsam import Estimate, EstimatorConfig, Measurement, PoseEstimator, read_recording
from vtgtsam.evaluation.consistency import covered, nees
from vtgtsam.evaluation.find import find_recordings
from vtgtsam.evaluation.phases import phases_of
from vtgtsam.metrics import Adds
from vtgtsam.objects import mesh_of
from vtgtsam.recording import Recording
from vtgtsam.recording.frames import evaluation_frames

from .symmetries import symmetry_of

VIS = EstimatorConfig.tuned(method="vis")
FRAME_ALONE = EstimatorConfig.tuned(method="vis+tac+pen")
MEMORY = EstimatorConfig.tuned()


class Replay(NamedTuple):
    """What a recording holds.

    Attributes:
        recording: The recording.
        frames: Its frames, those without a visual pose included.
        truths: The object's true pose in each.
        phases: The phase of the turn that each belongs to.
        adds: ADD-S of its object.
    """

    recording: Recording
    frames: list[Measurement]
    truths: list[gtsam.Pose3]
    phases: np.ndarray
    adds: Adds

    @property
    def times(self) -> np.ndarray:
        """Instants of the frames [s]."""
        return np.array([frame.time for frame in self.frames])

    @property
    def condition(self) -> str:
        """Noise and calibration in words."""
        info = self.recording.info
        error = ", calibration error" if info.get("calibration_error") == "yes" else ""
        tracker = "" if info.get("tracker") == "depth" else f", {info.get('tracker')}"
        return f"noise {info.get('noise_scale')}{error}{tracker}"


def below(folders: Sequence[Path]) -> list[Path]:
    """The recordings in each of some folders; different ones may have recordings of the same name."""
    return [path for folder in folders for path in find_recordings([folder]).values()]


def load(path: Path) -> Replay:
    """A recording's frames up to the last whose truth is known.

    Raises:
        VtgtsamError: It cannot be read, or holds no truth.
    """
    recording = read_recording(path)
    frames = evaluation_frames(recording)
    truths = recording.truth_at([frame.time for frame in frames])
    known = [(frame, T) for frame, T in zip(frames, truths, strict=True) if T is not None]
    phases = np.array(phases_of([frame for frame, _ in known]))
    adds = Adds(mesh_of(recording.object))
    return Replay(recording, [f for f, _ in known], [T for _, T in known], phases, adds)


def estimator(replay: Replay, config: EstimatorConfig = MEMORY) -> PoseEstimator:
    """A new estimator of the recording's hand and object."""
    return PoseEstimator(replay.recording.hand, replay.recording.object, config)


def copied(of: PoseEstimator) -> PoseEstimator:
    """The same estimator in the same state; hand and object are shared."""
    return copy.deepcopy(of, {id(part): part for part in (of.hand, of.obj)})


def run(of: PoseEstimator, frames: Sequence[Measurement]) -> list[Estimate]:
    """Its estimates."""
    return [of.update(frame) for frame in frames]


class Consistency(NamedTuple):
    """How far estimates say they are from the truth, modulo symmetry.

    Attributes:
        values: NEES a degree of freedom of the frames that have an estimate; NaN where nothing is finite.
        inside: Whether the 95 % region holds the truth.
        phases: The phases of these frames.
    """

    values: np.ndarray
    inside: np.ndarray
    phases: np.ndarray

    def of(self, phase: str) -> np.ndarray:
        """Which frames of a phase have a NEES."""
        return np.asarray((self.phases == phase) & np.isfinite(self.values))


def consistency(replay: Replay, estimates: Sequence[Estimate]) -> Consistency:
    """Judge the covariances of estimates, one a frame of the replay."""
    there = [n for n, estimate in enumerate(estimates) if estimate.T_wo is not None]
    values, dof = nees(
        [estimate.T_wo for estimate in estimates if estimate.T_wo is not None],
        np.array([estimates[n].covariance for n in there]),
        [replay.truths[n] for n in there],
        symmetry_of(replay.recording.object),
    )
    return Consistency(values, covered(values, dof, 0.95), replay.phases[there])


def errors_mm(
    adds: Adds, estimates: Sequence[Estimate], truths: Sequence[gtsam.Pose3]
) -> np.ndarray:
    """ADD-S of each estimate [mm]; infinite where there is none."""
    return np.array(
        [
            np.inf if estimate.T_wo is None else 1e3 * adds(estimate.T_wo, T_true)
            for estimate, T_true in zip(estimates, truths, strict=True)
        ]
    )
