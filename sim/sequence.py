# SPDX-License-Identifier: MIT
"""One sequence of a dataset: simulate it, let the camera watch and the tracker track, record it.

A sequence depends on nothing but what its ``Sequence`` says: it can be made again alone, in any order
and process, with the same bytes.
"""

from __future__ import annotations

import json
import zlib
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import gtsam
import numpy as np
from threadpoolctl import threadpool_limits

from vtgtsam.recording.provenance import object_metadata

from .calibration import CalibrationError
from .hands import load_description
from .objects import find_object
from .observe import DepthVideo, Noise, Video
from .power_grasp import power_grasp
from .record import Take, record
from .registration import drawn_registration
from .sampling import Sequence as Sample
from .sampling import sample_sequence
from .simulate import Trajectory, event_instant
from .world import World

CAMERA_NAMES = ("paper", "stereo")
# Settings that change nothing of what truly happens.
OF_SENSORS = ("tracker", "camera", "calibration_error", "robot", "registration_error")


@dataclass(frozen=True)
class Settings:
    """What all sequences of a run have in common.

    Attributes:
        dataset: "vary" or "occ".
        seed: All randomness comes from it, and from the sequence's object and number.
        tracker: One of ``record.TRACKERS``.
        hand: Name or path of the grasp description.
        ycb: Directory of YCB meshes; None for the built-in objects.
        images: Whether the images, depth and colour, are stored too.
        calibration_error: Whether camera, joints and edges have the errors of a real setup.
        robot: Number of the robot whose camera and joint errors all sequences have; None: each has its own.
        event: What happens to the grasp once it holds, "slip" or "drop"; None: nothing.
        camera: "paper" or "stereo".
        friction: "paper" (held objects creep) or "dry", see ``constants.FRICTION``.
        registration_error: Whether the tracker starts 5 mm and 5 degrees beside the true pose.
    """

    dataset: str
    seed: int = 0
    tracker: str = "depth"
    hand: str = "isyhand"
    ycb: str | None = None
    images: bool = False
    calibration_error: bool = False
    robot: int | None = None
    event: str | None = None
    camera: str = "paper"
    friction: str = "paper"
    registration_error: bool = False


@dataclass(frozen=True)
class SequenceName:
    """Which sequence of a run.

    Attributes:
        object: Name of the object.
        grasp: Number of the grasp, from 0.
    """

    object: str
    grasp: int

    def __str__(self) -> str:
        return f"{self.object}_{self.grasp}"


def make_sequence(settings: Settings, name: SequenceName, files: dict[float, Path]) -> Counter[str]:
    """Make one sequence and record it once for each noise scale.

    Args:
        settings: Settings of the run.
        name: Which sequence.
        files: The file to write for each noise scale.

    Returns:
        How often samples were rejected before one was accepted, by reason.

    Raises:
        NotGraspable: No sample was accepted.
        NoGraphics: Images are wanted and there is nothing to draw colour ones with.
    """
    return make_alike([(settings, files)], name)


def make_alike(
    runs: Sequence[tuple[Settings, dict[float, Path]]], name: SequenceName
) -> Counter[str]:
    """As ``make_sequence``, for several runs in which the same happens.

    It is simulated once, and filmed once by each camera.

    Args:
        runs: Settings, which differ in ``OF_SENSORS`` alone, and files of each run, for the same noise scales.
        name: Which sequence.
    """
    with threadpool_limits(1):  # the number of threads would show in the last bits
        world, sample = _sample(runs[0][0], name)
        for camera in dict.fromkeys(settings.camera for settings, _ in runs):
            by_camera = [run for run in runs if run[0].camera == camera]
            _film_and_record(by_camera, name, world, sample)
    return Counter(sample.rejections)


def _film_and_record(
    runs: Sequence[tuple[Settings, dict[float, Path]]],
    name: SequenceName,
    world: World,
    sample: Sample,
) -> None:
    """Record a sequence for several runs with the same camera."""
    video = film(runs[0][0].camera, world, sample.trajectory)
    color = None
    if runs[0][0].images:
        from .color import ColorVideo  # needs OpenGL

        color = ColorVideo(world, sample.trajectory, video.color_camera, video.T_wc * video.T_dc)
    _, noise_seed, *_ = _seeds(runs[0][0], name)
    for scale in runs[0][1]:
        noise = Noise(scale, noise_seed)
        for settings, files in runs:
            error = calibration_error(settings, name, len(world.hand.joint_names))
            registration = registration_error(settings, name, world)
            take = Take(world, sample.trajectory, video, noise, error, registration, color)
            metadata = _metadata(settings, name, world, sample, scale)
            record(take, settings.tracker, files[scale], metadata)


def calibration_error(settings: Settings, name: SequenceName, joint_count: int) -> CalibrationError:
    """The camera and joint errors that a sequence has."""
    if settings.robot is not None:
        return CalibrationError.of_robot(settings.robot, joint_count)
    if settings.calibration_error:
        _, _, error_seed, _ = _seeds(settings, name)
        return CalibrationError.drawn(joint_count, np.random.default_rng(error_seed))
    return CalibrationError.none(joint_count)


def registration_error(settings: Settings, name: SequenceName, world: World) -> gtsam.Pose3:
    """What the tracker's first pose is off, in the object's frame: T_wo registered = T_wo T."""
    if not settings.registration_error:
        return gtsam.Pose3()
    *_, seed = _seeds(settings, name)
    return drawn_registration(np.asarray(world.obj.center), np.random.default_rng(seed))


def film(camera: str, world: World, trajectory: Trajectory) -> Video:
    """What the camera of that name sees of a trajectory.

    Raises:
        VtgtsamError: The stereo camera is wanted and OpenCV is not installed.
    """
    if camera == "paper":
        return DepthVideo(world, trajectory)
    from .stereo import check_opencv

    check_opencv()
    from .stereo.video import StereoVideo

    return StereoVideo(world, trajectory)


def make_trajectory(settings: Settings, name: SequenceName) -> tuple[World, Trajectory]:
    """What truly happens in a sequence, without camera, tracker and recording.

    Raises:
        NotGraspable: No sample was accepted.
    """
    with threadpool_limits(1):
        world, sample = _sample(settings, name)
    return world, sample.trajectory


def prepare(settings: Settings, object_name: str) -> None:
    """Compute what all sequences of an object share and the cache keeps.

    Raises:
        VtgtsamError: The object cannot be simulated.
    """
    with threadpool_limits(1):
        world = _world(settings.hand, object_name, settings.ycb, settings.friction)
        if settings.dataset == "occ":
            power_grasp(world)


def _sample(settings: Settings, name: SequenceName) -> tuple[World, Sample]:
    world = _world(settings.hand, name.object, settings.ycb, settings.friction)
    grasp_seed, *_ = _seeds(settings, name)
    rng = np.random.default_rng(grasp_seed)
    return world, sample_sequence(world, settings.dataset, rng, settings.event)


@lru_cache(maxsize=1)  # grasps of one object follow each other
def _world(hand: str, object_name: str, ycb: str | None, friction: str) -> World:
    description = load_description(hand)
    obj = find_object(object_name, None if ycb is None else Path(ycb))
    return World(description, description.load_hand(), obj, friction)


def _seeds(settings: Settings, name: SequenceName) -> list[np.random.SeedSequence]:
    """Seeds of the grasp, the camera's noise, the calibration error and the registration's."""
    words = [zlib.crc32(text.encode()) for text in (settings.dataset, name.object)]
    return np.random.SeedSequence([settings.seed, *words, name.grasp]).spawn(4)


def _metadata(
    settings: Settings, name: SequenceName, world: World, sample: Sample, scale: float
) -> dict[str, str]:
    robot = {} if settings.robot is None else {"robot": str(settings.robot)}
    sees = settings.camera == "stereo" and settings.tracker.startswith("depth-hand")
    infrared = {"infrared": "yes"} if sees else {}  # whether the tracker was given such images
    return {
        **object_metadata(world.obj),
        "hand": world.hand.name,
        "dataset": settings.dataset,
        "sequence": str(name),
        "grasp": str(name.grasp),
        "seed": str(settings.seed),
        "noise_scale": f"{scale:g}",
        "tracker": settings.tracker,
        "camera": settings.camera,
        "friction": settings.friction,
        **infrared,
        "visual_covariance": "tracker",
        "calibration_error": "yes" if settings.calibration_error or robot else "no",
        **robot,
        **_event_metadata(settings, world, sample),
        "registration_error": "yes" if settings.registration_error else "no",
        "rejected": json.dumps(Counter(sample.rejections), sort_keys=True),
    }


def _event_metadata(settings: Settings, world: World, sample: Sample) -> dict[str, str]:
    """What happens in the sequence, and when it truly does [s]."""
    if settings.event is None:
        return {}
    time = event_instant(world, sample.trajectory, settings.event)
    assert time is not None  # else the sample was rejected
    return {"event": settings.event, "event_time": f"{time:g}"}
