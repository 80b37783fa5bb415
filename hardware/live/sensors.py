# SPDX-License-Identifier: MIT
"""The threads of pads and camera: each fills its slot and the recording."""

from __future__ import annotations

import threading
from collections.abc import Callable

import gtsam
import numpy as np

from hardware.camera.camera import Camera, CameraFrame
from hardware.tactile.board import PadBoard, PadReading
from hardware.tactile.pressure import ContactDetector
from vtgtsam.vision.depth_tracker import DepthTracker

from .fusion import as_recorded
from .recorder import Recorder
from .streams import RunClock, Streams

_POLL = 0.005  # [s], how long a reading may lie in the board's buffer


class Pads:
    """Turns the board's readings into contact bits, each reading once, as they come.

    Args:
        board: The pad board.
        detector: Calibrated for this run.
        pad_names: The hand's pads, in the detector's order.
        streams: Where the contacts go.
        clock: The run's clock.
        recorder: Gets them too.
    """

    def __init__(
        self,
        board: PadBoard,
        detector: ContactDetector,
        pad_names: tuple[str, ...],
        streams: Streams,
        clock: RunClock,
        recorder: Recorder,
    ) -> None:
        self._board = board
        self._detector = detector
        self._names = pad_names
        self._streams = streams
        self._clock = clock
        self._recorder = recorder
        self._last = clock.start

    def run(self, stop: threading.Event) -> None:
        """Take readings until ``stop`` is set."""
        while not stop.wait(_POLL):
            for reading in self._board.since(self._last):
                self._take(reading)

    def _take(self, reading: PadReading) -> None:
        self._last = reading.time
        state = self._detector.update(reading.values)
        instant_ns = self._clock.instant_ns(reading.time)
        pressure = np.nan_to_num(state.pressure)  # a recording holds numbers only: 0 for a dead pad
        self._streams.put(
            "pads",
            instant_ns,
            state,
            lambda: self._recorder.write(
                "tactile", instant_ns, self._names, pressure, state.contacts
            ),
        )


class Vision:
    """Tracks the object in the camera's images.

    The camera's frame is the world. A tracker that knows the hand gets the joints of the image's
    instant, not the newest. Looking for an object that is covered takes longer than an image may, so it
    is done in every other image, and the estimator goes on from touch at the full rate.

    Args:
        camera: The camera.
        tracker: Started at the object's pose.
        T_wh: Pose of the hand in the world.
        streams: Where the visual poses go.
        clock: The run's clock.
        recorder: Gets poses and images.
        images: Whether images are recorded.

    Attributes:
        lost: Images in which the object was not found, or not looked for.
        frame: The last images.
    """

    def __init__(
        self,
        camera: Camera,
        tracker: DepthTracker,
        T_wh: gtsam.Pose3,
        streams: Streams,
        clock: RunClock,
        recorder: Recorder,
        images: bool,
    ) -> None:
        self._camera = camera
        self._tracker = tracker
        self._T_wh = T_wh
        self._streams = streams
        self._clock = clock
        self._recorder = recorder
        self._images = images
        self.lost = 0
        self._rests = False  # leaves the next image alone
        self.frame: CameraFrame | None = None

    def run(self, stop: threading.Event, ended: Callable[[], None] = lambda: None) -> None:
        """Track until ``stop`` is set or a recording has ended."""
        while not stop.is_set():
            frame = self._camera.read()
            if frame is None:
                ended()
                return
            self._take(frame)

    def _take(self, frame: CameraFrame) -> None:
        self.frame = frame
        instant_ns = self._clock.instant_ns(frame.time)
        joints = self._streams.held("joints", instant_ns)
        if joints is None:
            return
        if self._images:
            self._record_images(instant_ns, frame)
        T_wo = None if self._rests else self._track(frame, joints.value)
        self._rests = T_wo is None and not self._rests
        if T_wo is None:
            self.lost += 1
        else:
            self._streams.put(
                "vision",
                instant_ns,
                as_recorded(T_wo),
                lambda: self._recorder.write("object_pose", instant_ns, T_wo),
            )
        self._streams.put("images", instant_ns, None)

    def _track(self, frame: CameraFrame, joints: np.ndarray) -> gtsam.Pose3 | None:
        return self._tracker.update(frame.depth, gtsam.Pose3(), joints, self._T_wh).T_wo

    def _record_images(self, instant_ns: int, frame: CameraFrame) -> None:
        self._recorder.write_image("depth", instant_ns, frame.depth)
        if frame.color is not None:
            self._recorder.write_image("color", instant_ns, frame.color)
