# SPDX-License-Identifier: MIT
"""What the estimator finds wrong with a recording's streams, as sentences."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from .frames import evaluation_frames
from .recording import Recording

if TYPE_CHECKING:
    from ..estimate import Estimate

SELDOM = 3  # frames; a fault that is named in fewer is not told
MOST_FRAMES = 20_000  # of a longer recording the first ones are looked at


def named_faults(recording: Recording) -> list[str]:
    """A sentence for each fault that the estimator names with the recommended settings."""
    from ..estimator import PoseEstimator

    frames = evaluation_frames(recording)[:MOST_FRAMES]
    if not frames:
        return []
    estimator = PoseEstimator(recording.hand, recording.object)
    return fault_sentences([estimator.update(frame) for frame in frames])


def fault_sentences(estimates: Sequence[Estimate]) -> list[str]:
    """A sentence for each fault, the first one first: in how many frames, and when it is named first."""
    frames: dict[str, list[float]] = {}
    for estimate in estimates:
        for word in estimate.faults:
            frames.setdefault(word, []).append(estimate.time)
    return [
        f"{word}: in {len(times)} of {len(estimates)} frames, first at {times[0]:.2f} s"
        for word, times in frames.items()
        if len(times) >= SELDOM
    ]
