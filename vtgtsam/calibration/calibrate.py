# SPDX-License-Identifier: MIT
"""Calibrate a robot from its recorded grasps.

Two rounds: the second tracks every grasp again with the first one's offsets, so that memory starts the graph nearer and
refuses fewer good visual poses. A grasp that contradicts the others is left out of the answer.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..config import EstimatorConfig
from ..estimator import PoseEstimator
from ..recording import TopicMap, load_topics
from .agreement import Used, agreeing, helpful
from .calibration import Calibration
from .keyframes import Grasp, grasp, thinned
from .posterior import Known, calibration_of
from .solve import SETTLED
from .sources import PathLike, Progress, Recordings, Source, one_robot, read_sources
from .touches import Felt

# The first round only says where the second one tracks and starts:
ROUGH = 0.3  # of the standard deviations believed before, and it need not settle further
ROUGH_KEYFRAMES = 2  # of which one is used


@dataclass(frozen=True, eq=False)
class Calibrated:
    """A calibration, and how it came about.

    Attributes:
        calibration: The calibration.
        before: What was believed of the offsets before any grasp, their standard deviations, shape (6 + J,).
        used: The grasps.
        left_out: Why each other recording was left out, by its name.
        sigma_before: Standard deviation of the object's position while a pad touches, without the calibration [m].
        sigma_after: The same with it.
    """

    calibration: Calibration
    before: np.ndarray
    used: tuple[Used, ...]
    left_out: dict[str, str]
    sigma_before: float
    sigma_after: float


def calibrate(recordings: Recordings, prior: Calibration | PathLike | None = None) -> Calibration:
    """Where a robot's camera and its joints' zeros are, from grasps that it made.

    Five to ten grasps of different objects in which every finger and the palm touch are enough. Recordings that do not
    help are left out, and logged: ``run`` says which and why.

    Args:
        recordings: Recordings, or their paths, or folders that are searched for such.
        prior: An earlier calibration of this robot to go on from, or its file.

    Returns:
        The calibration; its covariance says what is left open.

    Raises:
        CalibrationError: Recordings are of different hands or cameras, or none is of use.
        VtgtsamError: A path or the prior cannot be read.
    """
    return run(recordings, prior).calibration


def run(
    recordings: Recordings,
    prior: Calibration | PathLike | None = None,
    topics: TopicMap | PathLike | None = None,
    config: EstimatorConfig | None = None,
    progress: Progress | None = None,
    touches: Sequence[Felt] = (),
) -> Calibrated:
    """As ``calibrate``, with all that came of it as the answer.

    Args:
        recordings: As there.
        prior: As there.
        topics: Topic map of other people's bags.
        config: Settings of the estimator with memory; the recommended ones where not given.
        progress: Told what is being done, how many recordings it is done with, and how many there are.
        touches: Touches of the hand with itself, which count beside the grasps.
    """
    config = EstimatorConfig() if config is None else config
    if not config.memory:
        raise ValueError(f"calibrating needs a method with memory, got {config.method!r}")
    tell = progress or (lambda stage, done, total: None)
    if isinstance(prior, str | os.PathLike):
        prior = Calibration.from_yaml(prior)
    if isinstance(topics, str | os.PathLike):
        topics = load_topics(Path(topics))
    sources, left_out = read_sources(recordings, topics, prior, tell)
    robot = one_robot(sources, prior)
    known = Known.before(robot, sources[0].recording.hand, sources[0].frames[0], prior, config)
    first = _round("first", sources, known, prior, config, tell, touches, ROUGH, ROUGH_KEYFRAMES)
    second = _round("second", sources, known, first.calibration, config, tell, touches)
    return Calibrated(
        calibration=second.calibration,
        before=np.sqrt(np.diag(known.assumed)),
        used=second.used,
        left_out=left_out | second.left_out,
        sigma_before=first.sigma,
        sigma_after=second.sigma,
    )


class _Round(NamedTuple):
    """What came of tracking and solving once."""

    calibration: Calibration
    used: tuple[Used, ...]
    left_out: dict[str, str]
    sigma: float


def _round(
    name: str,
    sources: Sequence[Source],
    known: Known,
    tracked_with: Calibration | None,
    config: EstimatorConfig,
    tell: Progress,
    touches: Sequence[Felt],
    settled: float = SETTLED,
    every: int = 1,
) -> _Round:
    """Track all recordings with a calibration, and solve for a new one from some of the keyframes."""
    grasps = []
    for count, source in enumerate(sources, 1):
        grasps.append(_tracked(source, config, tracked_with))
        tell(f"{name} round", count, len(sources))
    chosen, left_out = helpful(grasps)
    starts = [known.belief.mean]
    if tracked_with is not None and not np.array_equal(tracked_with.offsets, starts[0]):
        starts.append(tracked_with.offsets)
    some = [thinned(each, every) for each in chosen]
    agreed = agreeing(
        some, known.belief, np.array(starts), known.camera_origin, config, touches, settled
    )
    names = {each.name for each in agreed.grasps}
    made_from = [source.digest for source in sources if source.name in names]
    return _Round(
        calibration=calibration_of(agreed.solved.belief, known, agreed.grasps, made_from),
        used=tuple(agreed.used),
        left_out=left_out | agreed.left_out,
        sigma=float(np.median([each.sigma for each in agreed.grasps])),
    )


def _tracked(source: Source, config: EstimatorConfig, calibration: Calibration | None) -> Grasp:
    recording = source.recording
    estimator = PoseEstimator(recording.hand, recording.object, config, calibration)
    return grasp(source.name, estimator, source.frames)
