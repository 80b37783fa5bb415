# SPDX-License-Identifier: MIT
"""A recorded run once more: the same frames, and the calibrations that were in force in each."""

from __future__ import annotations

from ..config import EstimatorConfig
from ..estimate import Estimate
from ..estimator import PoseEstimator
from ..recording import Recording


def replay(recording: Recording, config: EstimatorConfig | None = None) -> list[Estimate]:
    """What the run's estimator said in each frame that the recording holds.

    Args:
        recording: Of a live run.
        config: The run's settings; the recommended ones where not given.

    Raises:
        RecordingError: The recording is of no live run, or a calibration in it cannot be read.
    """
    first, changes = recording.calibrations
    estimator = PoseEstimator(recording.hand, recording.object, config, first)
    waiting = list(changes)
    estimates = []
    for frame in recording.measurements(rate="recorded"):
        while waiting and waiting[0][0] <= frame.time:
            estimator.recalibrate(waiting.pop(0)[1])
        estimates.append(estimator.update(frame))
    return estimates
