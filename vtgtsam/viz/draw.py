# SPDX-License-Identifier: MIT
"""A recording in the viewer: its streams and, where they are given, each method's estimates."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import gtsam
import numpy as np
import rerun as rr
import rerun.blueprint as rrb

from ..frame import contact_bits, hand_of
from ..recording.camera import camera_intrinsics, color_images, depth_images
from . import names
from .frame import FrameDrawing
from .layout import Eye, layout
from .pads import PadJudge
from .scene import Scene
from .tracks import Track

if TYPE_CHECKING:
    from ..measurement import Measurement
    from ..recording import Recording

FRONT = np.array([1.0, 0.0, 0.8])  # [m], from the object to where a camera might stand
_IMAGES: dict[str, Callable[[Path], Iterator[tuple[float, np.ndarray]]]] = {
    "color": color_images,
    "depth": depth_images,
}


def recording_layout(
    recording: Recording, frames: Sequence[Measurement], tracks: Sequence[Track]
) -> rrb.Blueprint:
    """How the viewer arranges a recording; of its methods' objects the last is seen at first."""
    images = [name for name, read in _IMAGES.items() if any(True for _ in read(recording.path))]
    methods = [track.name for track in tracks]
    return layout(hidden=methods[:-1], eye=_eye(recording, frames, tracks), images=images)


def draw_recording(
    stream: rr.RecordingStream,
    recording: Recording,
    frames: Sequence[Measurement],
    tracks: Sequence[Track],
) -> None:
    """Write all of a recording into a stream.

    Args:
        stream: Where to.
        recording: The recording.
        frames: Its frames.
        tracks: Each method's answers in these frames.
    """
    camera_is_world = is_identity(recording.camera_pose)
    scene = Scene(stream, recording.hand, recording.object, camera_is_world)
    _draw_camera(scene, recording, frames)
    drawing = _Drawing(scene, recording, tracks)
    truth = _truth(recording, frames)
    for index, frame in enumerate(frames):
        drawing.draw(index, frame, truth[index])


def is_identity(T_wc: gtsam.Pose3 | None) -> bool:
    """Whether the camera's frame is the world, as in a live run."""
    return T_wc is not None and T_wc.equals(gtsam.Pose3(), 1e-9)


class _Drawing:
    """Draws a recording's frames one after the other."""

    def __init__(self, scene: Scene, recording: Recording, tracks: Sequence[Track]) -> None:
        self._scene = scene
        self._pads = recording.hand
        self._tracks = tracks
        self._drawing = FrameDrawing(scene, recording.hand, recording.object)
        # Pads are judged at one method's poses: the last one's that uses touch, else the last one's.
        candidates = [track for track in tracks if track.uses_touch] or tracks
        self._judged = candidates[-1] if candidates else None
        config = None if self._judged is None else self._judged.config
        self._judge = PadJudge(recording.hand, recording.object, config)

    def draw(self, index: int, frame: Measurement, T_true: gtsam.Pose3 | None) -> None:
        """Everything of one frame."""
        self._scene.at(frame.time)
        self._draw_hand(index, frame)
        if T_true is not None:
            self._scene.object(names.TRUTH, T_true)
        for track in self._tracks:
            if track.statuses:
                weight = track.visual_weights[index]
                self._drawing.verdict(track.name, track.statuses[index], weight)
            T_wo = track.poses[index]
            if T_wo is not None:
                self._drawing.pose(track.name, T_wo, frame.T_wo_visual, T_true)
                if len(track.covariances):
                    self._scene.uncertainty(track.name, T_wo, track.covariances[index])

    def _draw_hand(self, index: int, frame: Measurement) -> None:
        assert frame.joints is not None  # a recording always has them
        contacts = contact_bits(frame.contacts, self._pads.pad_names)
        T_wo = None if self._judged is None else self._judged.poses[index]
        distances = weights = None
        if T_wo is not None:
            hand = hand_of(frame, self._pads)
            T_wp = hand.T_wh.matrix() @ hand.T_hp
            distances = self._judge.distances(T_wp, T_wo)
            weights = self._judge.weights(distances)
        self._drawing.hand(frame.joints, frame.T_wh or gtsam.Pose3(), contacts, distances, weights)


def _draw_camera(scene: Scene, recording: Recording, frames: Sequence[Measurement]) -> None:
    """The camera where it is known, and its images at their own instants."""
    intrinsics = camera_intrinsics(recording.path)
    if intrinsics is None:
        return
    poses = [(frame.time, recording.camera_pose_at(frame.time)) for frame in frames]
    last = None
    for time, T_wc in poses:
        if T_wc is not None and (last is None or not T_wc.equals(last, 0.0)):
            scene.at(time)
            scene.camera(intrinsics, T_wc)
            last = T_wc
    for name, read in _IMAGES.items():
        for time, image in read(recording.path):
            scene.at(time)
            getattr(scene, name)(image)


def _truth(recording: Recording, frames: Sequence[Measurement]) -> Sequence[gtsam.Pose3 | None]:
    if recording.ground_truth is None:
        return [None] * len(frames)
    return recording.truth_at([frame.time for frame in frames])


def _eye(
    recording: Recording, frames: Sequence[Measurement], tracks: Sequence[Track]
) -> Eye | None:
    """Beside the camera, looking at the object's first known place, else at the hand."""
    if not frames:
        return None
    known = [_truth(recording, frames[:1])[0], *(track.poses[0] for track in tracks)]
    T_wo = next((pose for pose in known if pose is not None), None)
    target = (frames[0].T_wh or gtsam.Pose3()).translation()
    if T_wo is not None:
        target = T_wo.transformFrom(recording.object.center)
    up = np.array([0.0, -1.0, 0.0] if is_identity(recording.camera_pose) else [0.0, 0.0, 1.0])
    T_wc = recording.camera_pose
    camera = target + FRONT if T_wc is None else T_wc.translation()
    return Eye.beside(target, camera, up) if np.linalg.norm(camera - target) > 0 else None
