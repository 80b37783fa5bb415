# SPDX-License-Identifier: MIT
"""Calibrate a robot from its recorded grasps.

Two rounds: the second tracks every grasp again with the first one's offsets, so that memory starts the graph nearer and
refuses fewer good visual poses. A grasp that contradicts the others is left out of the second, and of the answer.
"""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..config import EstimatorConfig
from ..estimator import PoseEstimator
from ..evaluation.find import find_recordings
from ..exceptions import CalibrationError, VtgtsamError
from ..measurement import Measurement
from ..offsets import CalibrationPrior
from ..recording import Recording, TopicMap, load_topics, read_recording
from ..recording.frames import evaluation_frames
from .calibration import Calibration
from .consistency import nees
from .directions import unseen
from .keyframes import Grasp, grasp
from .residuals import Residuals, residuals
from .robot import Robot
from .solve import Belief, Solved, solve

PathLike = str | os.PathLike[str]
Progress = Callable[[str, int, int], None]

FEWEST_SEEN = 0.5  # share of the visual poses that memory must have believed
FEWEST_KEYFRAMES = 6  # with a pad that touches: one second
MOST_NEES = 4.0  # a grasp this far from the others is of something else
MOST_CONTACT = 0.0025  # [m], touching pads that stay so far from the surface touch something else


class Used(NamedTuple):
    """A grasp that the calibration was made from.

    Attributes:
        name: What its recording is called.
        residuals: What is left over in it.
        nees: How far it is from the others, in units of what both are unsure of; about 1.
        keyframes: How many frames of it were used.
    """

    name: str
    residuals: Residuals
    nees: float
    keyframes: int


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


def calibrate(
    recordings: PathLike | Recording | Iterable[PathLike | Recording],
    prior: Calibration | PathLike | None = None,
) -> Calibration:
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
    recordings: PathLike | Recording | Iterable[PathLike | Recording],
    prior: Calibration | PathLike | None = None,
    topics: TopicMap | PathLike | None = None,
    config: EstimatorConfig | None = None,
    progress: Progress | None = None,
) -> Calibrated:
    """As ``calibrate``, with all that came of it as the answer.

    Args:
        recordings: As there.
        prior: As there.
        topics: Topic map of other people's bags.
        config: Settings of the estimator with memory; the recommended ones where not given.
        progress: Told what is being done, how many recordings it is done with, and how many there are.
    """
    config = EstimatorConfig() if config is None else config
    if not config.memory:
        raise ValueError(f"calibrating needs a method with memory, got {config.method!r}")
    tell = progress or (lambda stage, done, total: None)
    if isinstance(prior, str | os.PathLike):
        prior = Calibration.from_yaml(prior)
    if isinstance(topics, str | os.PathLike):
        topics = load_topics(Path(topics))
    sources, left_out = _read(recordings, topics, prior, tell)
    robot, origin, known = _known(sources, prior, config)
    first = _round("first", sources, robot, origin, known, prior, prior, config, tell)
    second = _round("second", sources, robot, origin, known, prior, first.calibration, config, tell)
    return Calibrated(
        calibration=second.calibration,
        before=np.sqrt(np.diag(_assumed(config, sources[0]))),
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
    sources: Sequence[_Source],
    robot: Robot,
    origin: np.ndarray,
    known: Belief,
    prior: Calibration | None,
    tracked_with: Calibration | None,
    config: EstimatorConfig,
    tell: Progress,
) -> _Round:
    """Track all recordings with a calibration, and solve for a new one."""
    grasps = []
    for count, source in enumerate(sources, 1):
        grasps.append(_tracked(source, config, tracked_with))
        tell(f"{name} round", count, len(sources))
    helpful, useless = _helpful(grasps)
    start = known.mean if tracked_with is None else tracked_with.offsets
    solved, chosen, odd = _agreeing(helpful, known, start, origin, config)
    return _Round(
        calibration=_calibration(robot, origin, solved, chosen, sources, prior, config),
        used=tuple(_used(each, n, solved, origin) for n, each in enumerate(chosen)),
        left_out=useless | odd,
        sigma=float(np.median([each.sigma for each in chosen])),
    )


@dataclass(frozen=True, eq=False)
class _Source:
    """A recording that is of use as far as one can see without tracking."""

    name: str
    digest: str
    recording: Recording
    frames: Sequence[Measurement]


def _read(
    recordings: PathLike | Recording | Iterable[PathLike | Recording],
    topics: TopicMap | None,
    prior: Calibration | None,
    tell: Progress,
) -> tuple[list[_Source], dict[str, str]]:
    """The recordings, and why some were left out."""
    if isinstance(recordings, str | os.PathLike | Recording):
        recordings = [recordings]
    given = list(recordings)
    paths = [path for path in given if not isinstance(path, Recording)]
    named: dict[str, Recording | Path] = dict(find_recordings(paths)) if paths else {}
    named |= {str(each.path): each for each in given if isinstance(each, Recording)}
    if not named:
        raise CalibrationError(
            "no recordings given; name .mcap files, rosbag2 folders, or folders of them"
        )
    sources: list[_Source] = []
    left_out: dict[str, str] = {}
    seen = dict.fromkeys(() if prior is None else prior.made_from, "the prior")
    for count, (name, each) in enumerate(named.items(), 1):
        try:
            recording = each if isinstance(each, Recording) else read_recording(each, topics=topics)
            digest = _digest(recording)
            if digest in seen:
                left_out[name] = f"the same as {seen[digest]}"
                continue
            frames = evaluation_frames(recording)
            recording.object  # noqa: B018  reads it, so that what is wrong with it is known now
        except (VtgtsamError, ValueError, OSError) as error:
            left_out[name] = " ".join(str(error).split())
            continue
        seen[digest] = name
        sources.append(_Source(name, digest, recording, frames))
        tell("reading", count, len(named))
    if not sources:
        raise CalibrationError(f"no recording is of use: {_sentences(left_out)}")
    return sources, left_out


def _digest(recording: Recording) -> str:
    """What tells a recording from others: a hash of its instants, joints and visual poses."""
    digest = hashlib.sha256()
    streams = recording.streams
    for stream in (streams.joints, streams.contacts, streams.vision):
        if stream is not None:
            digest.update(np.asarray(stream.times_ns).tobytes())
    if streams.vision is not None:
        digest.update(np.array([pose.translation() for pose in streams.vision.poses]).tobytes())
    return digest.hexdigest()[:16]


def _known(
    sources: Sequence[_Source], prior: Calibration | None, config: EstimatorConfig
) -> tuple[Robot, np.ndarray, Belief]:
    """Whose the recordings are, where its camera turns about, and what is known of it."""
    first = sources[0]
    if prior is not None:
        robot, whose = prior.robot, "the prior"
    else:
        try:
            robot, whose = Robot.of(first.recording), first.name
        except CalibrationError as error:
            raise CalibrationError(f"{first.name}: {error}") from None
    for source in sources:
        try:
            robot.check(source.recording, whose)
        except CalibrationError as error:
            raise CalibrationError(
                f"{source.name}: {error}; calibrate one robot with one camera at a time"
            ) from None
    if prior is not None:
        return robot, prior.camera_origin, Belief(prior.offsets, prior.covariance)
    T_wh = first.frames[0].T_wh
    origin = np.zeros(3) if T_wh is None else T_wh.translation()
    covariance = _assumed(config, first)
    return robot, origin, Belief(np.zeros(len(covariance)), covariance)


def _assumed(config: EstimatorConfig, source: _Source) -> np.ndarray:
    """What is believed of a recording's robot before any grasp."""
    units = source.recording.hand.zero_units
    return CalibrationPrior.of_config(config, units, np.zeros(3)).covariance


def _tracked(source: _Source, config: EstimatorConfig, calibration: Calibration | None) -> Grasp:
    recording = source.recording
    estimator = PoseEstimator(recording.hand, recording.object, config, calibration)
    return grasp(source.name, estimator, source.frames)


def _helpful(grasps: Sequence[Grasp]) -> tuple[list[Grasp], dict[str, str]]:
    """Grasps that can say something, and why the others cannot."""
    helpful = []
    left_out: dict[str, str] = {}
    for each in grasps:
        if len(each.keyframes) < FEWEST_KEYFRAMES:
            left_out[each.name] = (
                "no pad touches for as long as a second while the object is tracked"
                + _because(each)
            )
        elif each.seen < FEWEST_SEEN:
            left_out[each.name] = (
                f"{1 - each.seen:.0%} of its visual poses contradict touch and memory: the tracker had lost the "
                f"object, or the object is not the mesh{_because(each)}"
            )
        else:
            helpful.append(each)
    if not helpful:
        raise CalibrationError(f"no recording is of use: {_sentences(left_out)}")
    return helpful, left_out


def _because(each: Grasp) -> str:
    """What the estimator found wrong with a grasp, to be put behind a sentence."""
    return f" ({', '.join(each.faults)})" if each.faults else ""


def _agreeing(
    grasps: Sequence[Grasp],
    known: Belief,
    start: np.ndarray,
    origin: np.ndarray,
    config: EstimatorConfig,
) -> tuple[Solved, list[Grasp], dict[str, str]]:
    """The solution of those grasps that agree with each other, and why the others do not."""
    chosen = list(grasps)
    left_out: dict[str, str] = {}
    while True:
        solved = solve(chosen, known, start, origin, config)
        judged = [(_used(each, n, solved, origin), n) for n, each in enumerate(chosen)]
        reasons = {n: reason for used, n in judged if (reason := _oddity(used))}
        if not reasons:
            return solved, chosen, left_out
        worst = max(reasons, key=lambda n: _how_odd(judged[n][0]))
        left_out[chosen[worst].name] = reasons[worst]
        del chosen[worst]
        if not chosen:
            raise CalibrationError(f"no recording is of use: {_sentences(left_out)}")


def _how_odd(used: Used) -> float:
    return max(used.nees / MOST_NEES, used.residuals.contact / MOST_CONTACT)


def _oddity(used: Used) -> str:
    """What speaks against a grasp; empty where nothing does."""
    if used.residuals.contact > MOST_CONTACT:
        return (
            f"touching pads stay {1e3 * used.residuals.contact:.1f} mm from the object's surface: "
            "another object than the mesh, or another scale"
        )
    if used.nees > MOST_NEES:
        return (
            f"it contradicts the others (NEES {used.nees:.1f}, about 1 is right): another object than the mesh, "
            "a tracker that sat beside the object, or another robot"
        )
    return ""


def _used(each: Grasp, number: int, solved: Solved, origin: np.ndarray) -> Used:
    said = solved.said[number]
    left = residuals(each, number, solved.values, origin)
    apart = nees(said.information, said.pull, solved.belief.covariance)
    return Used(each.name, left, apart, len(each.keyframes))


def _calibration(
    robot: Robot,
    origin: np.ndarray,
    solved: Solved,
    grasps: Sequence[Grasp],
    sources: Sequence[_Source],
    prior: Calibration | None,
    config: EstimatorConfig,
) -> Calibration:
    mean, covariance = solved.belief
    touches = np.sum([frame.touching for each in grasps for frame in each.keyframes], axis=0)
    assumed = _assumed(config, sources[0])
    names = {each.name for each in grasps}
    made_from = [source.digest for source in sources if source.name in names]
    earlier = () if prior is None else prior.made_from
    return Calibration(
        robot=robot,
        camera=mean[:6],
        camera_origin=origin,
        joint_zeros=dict(zip(robot.joint_names, mean[6:].tolist(), strict=True)),
        covariance=(covariance + covariance.T) / 2,
        unseen=unseen(covariance, assumed, grasps[0].hand, touches),
        made_from=(*earlier, *made_from),
    )


def _sentences(left_out: dict[str, str]) -> str:
    return "; ".join(f"{name}: {reason}" for name, reason in left_out.items())
