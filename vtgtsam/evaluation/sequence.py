# SPDX-License-Identifier: MIT
"""One recording, all methods: estimates and their errors."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ..config import EstimatorConfig
from ..estimator import PoseEstimator
from ..exceptions import RecordingError, VtgtsamError
from ..frame import contact_bits
from ..input.plain import plain, sentence
from ..recording import Recording
from ..recording.frames import evaluation_frames
from . import store
from .errors import errors_table
from .estimates import estimates_table
from .given import Given
from .phases import phases_of
from .remote import RemoteRecording
from .resume import sequence_key

CONDITION = ("dataset", "tracker", "noise_scale")  # as the metadata have them
LONGEST_NAME = 80  # [characters] of them: files are called by them

logger = logging.getLogger(__name__)


@dataclass(frozen=True)
class Task:
    """One sequence to evaluate.

    Attributes:
        sequence: Its id.
        recording: Its recording, which is fetched where it is not on disk.
        out: The run's folder.
        configs: Each method's configuration.
        given: Hand, object and topic map to use instead of the recording's own, and the robot's calibration.
        code: The caller's ``code_version``.
    """

    sequence: str
    recording: Path | RemoteRecording
    out: Path
    configs: Mapping[str, EstimatorConfig]
    given: Given
    code: str


@dataclass(frozen=True)
class Outcome:
    """What became of a task.

    Attributes:
        sequence: The sequence's id.
        about: Description stored with its results; empty where it failed.
        problem: Why it failed, in one line; empty where it did not.
        reused: Whether its results were there already.
    """

    sequence: str
    about: Mapping[str, Any]
    problem: str = ""
    reused: bool = False


def evaluate_sequence(task: Task) -> Outcome:
    """Evaluate one sequence and store its results, unless they are there already.

    Whatever goes wrong with this sequence is told in the outcome, so that the others go on.
    """
    try:
        key = sequence_key(task.recording, task.configs, task.given.digest(), task.code)
        about = store.done(task.out, task.sequence, key)
        if about is not None:
            return Outcome(task.sequence, about, reused=True)
        with _on_disk(task.recording) as path:
            return Outcome(task.sequence, _evaluate(task, path, key))
    except Exception as error:
        store.forget(task.out, task.sequence)
        if isinstance(error, (VtgtsamError, ValueError, OSError)):
            return Outcome(task.sequence, {}, problem=sentence(error))
        logger.exception("%s failed", task.sequence)
        return Outcome(task.sequence, {}, problem=sentence(f"{type(error).__name__}: {error}"))


def _on_disk(recording: Path | RemoteRecording) -> AbstractContextManager[Path]:
    return nullcontext(recording) if isinstance(recording, Path) else recording.fetched()


def _evaluate(task: Task, path: Path, key: str) -> dict[str, Any]:
    from threadpoolctl import threadpool_limits

    recording = task.given.read(path)
    frames = evaluation_frames(recording)
    if not frames:
        raise RecordingError(f"{path.name} has no frame with a visual pose: nothing to estimate")
    with threadpool_limits(1):
        estimates = {
            name: [estimator.update(frame) for frame in frames]
            for name, estimator in _estimators(recording, task).items()
        }
        contacts = [contact_bits(frame.contacts, recording.hand.pad_names) for frame in frames]
        phases = phases_of(frames)
        about = _describe(task.sequence, recording, [frame.time for frame in frames])
        about |= {"key": key, "frames": len(frames)}
        metrics, about["note"] = errors_table(recording, estimates, phases, about)
    store.keep(task.out, task.sequence, estimates_table(estimates, contacts), metrics, about)
    return about


def _estimators(recording: Recording, task: Task) -> dict[str, PoseEstimator]:
    return {
        name: PoseEstimator(recording.hand, recording.object, config, task.given.calibration)
        for name, config in task.configs.items()
    }


def _describe(sequence: str, recording: Recording, times: Sequence[float]) -> dict[str, Any]:
    info = recording.info
    return {
        "sequence": sequence,
        "object": recording.object.name,
        **{name: plain(info.get(name, ""), LONGEST_NAME) for name in CONDITION},
        "pads": list(recording.hand.pad_names),
        "camera_poses": _camera_poses(recording, times),
        "warnings": list(recording.warnings),
    }


def _camera_poses(recording: Recording, times: Sequence[float]) -> list[tuple[float, Any]]:
    """Times from which on the camera has a new pose, and that pose T_wc as rows."""
    changes: list[tuple[float, Any]] = []
    for time in times:
        T_wc = recording.camera_pose_at(time)
        if T_wc is not None:
            rows = T_wc.matrix().tolist()
            if not changes or rows != changes[-1][1]:
                changes.append((time, rows))
    return changes
