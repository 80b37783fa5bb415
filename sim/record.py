# SPDX-License-Identifier: MIT
"""Write a simulated sequence as a recording, with what a visual tracker makes of its images."""

from __future__ import annotations

import heapq
import itertools
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from operator import itemgetter
from pathlib import Path
from typing import TYPE_CHECKING, Any

import gtsam
import numpy as np

from vtgtsam.recording import RecordingWriter
from vtgtsam.recording.provenance import mesh_file
from vtgtsam.vision.depth_tracker import FORMS, make_tracker
from vtgtsam.vision.hand_back import BACK

from . import tracker_model
from .calibration import CalibrationError
from .fused import FusedLoop
from .observe import Noise, Video
from .simulate import Trajectory
from .world import World

if TYPE_CHECKING:
    from .color import ColorVideo

TRACKERS = (*FORMS, *(form + BACK for form in FORMS), tracker_model.NAME)
# An instant and what to write then.
Event = tuple[float, Callable[[RecordingWriter], None]]


@dataclass(frozen=True)
class Take:
    """A sequence as the sensors have it.

    Attributes:
        world: Hand and object.
        trajectory: What truly happened.
        video: What the camera saw of it.
        noise: The camera's noise.
        error: What the setup believes wrongly.
        registration: What the tracker's first pose is off, T_wo registered = T_wo T.
        color: What the camera saw in colour; where it is given, all images are recorded.
    """

    world: World
    trajectory: Trajectory
    video: Video
    noise: Noise
    error: CalibrationError
    registration: gtsam.Pose3
    color: ColorVideo | None = None

    @property
    def T_wc(self) -> gtsam.Pose3:
        """Where the camera is believed to be."""
        return self.error.T_error * self.video.T_wc

    @property
    def T_wo_registered(self) -> gtsam.Pose3:
        """The pose at which the tracker begins: the true one in the camera's frame, but for the registration."""
        T_wo = gtsam.Pose3(self.trajectory.frame_T_wo[0])
        return self.T_wc * self.video.T_wc.between(T_wo) * self.registration

    def measured_joints(self, joints: np.ndarray) -> np.ndarray:
        """Joint angles [rad] as the encoders show them."""
        return np.asarray(joints + self.error.joints)


def record(take: Take, tracker: str, path: Path, metadata: dict[str, str]) -> None:
    """Record a take.

    Args:
        take: The sequence.
        tracker: Which visual tracker, one of ``TRACKERS``.
        path: The file to write.
        metadata: What it says about itself.
    """
    streams = [_samples(take), _frames(take, tracker)]
    if tracker == tracker_model.NAME:
        streams = [_samples(take), _modelled(take)] + ([_images(take)] if take.color else [])
    events = heapq.merge(*streams, key=itemgetter(0))
    hand, mesh = take.world.hand, mesh_file(take.world.obj)
    metadata = metadata | {"registered_pose": pose_text(take.T_wo_registered)}
    with RecordingWriter(path, metadata, hand_xml=hand.xml, mesh=mesh) as writer:
        writer.camera_pose(0.0, take.T_wc if take.color is None else take.T_wc * take.video.T_dc)
        writer.camera_info(
            0.0, take.video.camera if take.color is None else take.video.color_camera
        )
        for _, write in events:
            write(writer)


def pose_text(T_wo: gtsam.Pose3) -> str:
    """A pose as in TUM files: x y z [m], qx qy qz qw."""
    quaternion: Any = T_wo.rotation().toQuaternion()
    numbers = [*T_wo.translation(), *quaternion.coeffs()]  # coeffs: xyzw
    return " ".join(f"{number:.12g}" for number in numbers)


def _samples(take: Take) -> Iterator[Event]:
    """Joints, pads, hand and truth at 100 Hz."""
    t, hand = take.trajectory, take.world.hand
    for k, time in enumerate(t.time.tolist()):

        def write(writer: RecordingWriter, k: int = k, time: float = time) -> None:
            writer.joint_states(time, hand.joint_names, take.measured_joints(t.joints[k]))
            writer.tactile(time, hand.pad_names, t.pressure[k], t.contacts[k])
            writer.hand_pose(time, gtsam.Pose3(t.T_wh[k]))
            writer.truth(time, gtsam.Pose3(t.T_wo[k]))

        yield time, write


def _frames(take: Take, form: str) -> Iterator[Event]:
    """The tracker's poses, and the images, at the camera's rate.

    The tracker is told the object's pose in the camera's frame at the first frame, as by the paper's
    registration, and nothing of the truth afterwards. A frame in which it has lost the object has no pose.
    One with "+back" is told the fused pose, too, where it has lost itself.
    """
    t, camera = take.trajectory, take.video.camera
    tracker = make_tracker(form.removesuffix(BACK), take.world.obj, camera, take.world.hand)
    fused = FusedLoop(take, tracker) if form.endswith(BACK) else None
    tracker.start(take.T_wo_registered)
    colors = itertools.repeat(None) if take.color is None else take.color.images(take.noise)
    images = zip(
        take.video.images(take.noise, take.error), take.video.infrared(take.noise), strict=True
    )
    for k, ((image, infrared), color) in enumerate(zip(images, colors, strict=False)):
        joints, T_wh = take.measured_joints(t.frame_joints[k]), gtsam.Pose3(t.frame_T_wh[k])
        beside = {} if infrared is None else {"infrared": infrared}
        tracked = tracker.update(image, take.T_wc, joints, T_wh, **beside)
        if fused is not None:
            fused.after(k, tracked)
        time = float(t.frame_time[k])

        def write(
            writer: RecordingWriter,
            time: float = time,
            T_wo: gtsam.Pose3 | None = tracked.T_wo,
            covariance: np.ndarray = tracked.covariance,
            correlation: float = tracked.correlation,
            image: np.ndarray = image,
            color: np.ndarray | None = color,
        ) -> None:
            if T_wo is not None:
                if correlation > 0.0:
                    writer.vision_correlation(time, correlation)
                writer.object_pose(time, T_wo, covariance)
            if color is not None:
                writer.depth(time, take.video.aligned(image))
                writer.color(time, color)

        yield time, write


def _images(take: Take) -> Iterator[Event]:
    """The images at the camera's rate."""
    assert take.color is not None
    depths = take.video.images(take.noise, take.error)
    images = zip(depths, take.color.images(take.noise), strict=True)
    for time, (depth, color) in zip(take.trajectory.frame_time.tolist(), images, strict=True):

        def write(
            writer: RecordingWriter,
            time: float = time,
            depth: np.ndarray = depth,
            color: np.ndarray = color,
        ) -> None:
            writer.depth(time, take.video.aligned(depth))
            writer.color(time, color)

        yield time, write


def _modelled(take: Take) -> Iterator[Event]:
    """The poses of a model of a learnt tracker, each when it is known."""
    rng = np.random.default_rng(take.noise.seed)
    video = take.video
    found = tracker_model.poses(take.world, take.trajectory, video.camera, video.T_wc, rng)
    for time, T_co in zip(take.trajectory.frame_time.tolist(), found, strict=True):
        if T_co is None:
            continue
        known = time + tracker_model.LATENCY

        def write(
            writer: RecordingWriter,
            time: float = time,
            T_co: gtsam.Pose3 = T_co,
            known: float = known,
        ) -> None:
            writer.object_pose(time, take.T_wc * T_co, received=known)

        yield known, write
