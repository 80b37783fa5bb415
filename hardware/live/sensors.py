# SPDX-License-Identifier: MIT
"""The threads of pads and camera: each fills its slot and the recording."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable

import gtsam
import numpy as np

from hardware.camera.camera import Camera, CameraError, CameraFrame
from hardware.camera.imager import LeftImager
from hardware.device import PadDevice, PadState
from vtgtsam import Calibration
from vtgtsam.live.clock import RunClock
from vtgtsam.live.inputs import Inputs
from vtgtsam.vision.depth_tracker import DepthTracker
from vtgtsam.vision.tracker import TrackedPose

from .calibrating import as_seen

log = logging.getLogger(__name__)

_POLL = 0.005  # [s], how long a reading may lie in the board's buffer
_RETRY = 0.2  # [s], after a camera gave no image
OLD = 3.0  # [s], an image that is taken for older than this, or for younger than now, has a wrong stamp


class NoPads(PadDevice):
    """A hand without pads: nothing is ever in contact, 50 times a second.

    Args:
        count: Pads of the hand's model, whose surfaces still count as what the object cannot enter.
        clock: Monotonic time [s].
    """

    def __init__(self, count: int, clock: Callable[[], float] = time.monotonic) -> None:
        self._state = PadState(np.zeros(count), np.zeros(count, dtype=bool))
        self._clock = clock

    def prepare(self) -> str:
        """There is nothing to do."""
        return "this hand has no pads: the object is held by vision and the hand's shape alone"

    def since(self, instant: float) -> list[tuple[float, PadState]]:
        """No contact now, if it is time for a state."""
        now = self._clock()
        return [(now, self._state)] if now >= instant + 0.02 else []

    def close(self) -> None:
        """Nothing is held."""


class Pads:
    """Puts the pads' states into their stream, each once, as they come.

    Args:
        device: The pads, prepared.
        pad_names: The hand's pads, in the order of the states.
        inputs: Where the states go.
        clock: The run's clock.
    """

    def __init__(
        self,
        device: PadDevice,
        pad_names: tuple[str, ...],
        inputs: Inputs,
        clock: RunClock,
    ) -> None:
        self._device = device
        self._names = pad_names
        self._inputs = inputs
        self._clock = clock
        self._last = clock.start

    def run(self, stop: threading.Event) -> None:
        """Take states until ``stop`` is set, from the present on."""
        self._last = self._clock.start + self._clock.now_ns() / 1e9
        while not stop.wait(_POLL):
            for instant, state in self._device.since(self._last):
                self._take(instant, state)

    def _take(self, instant: float, state: PadState) -> None:
        self._last = instant
        self._inputs.put_contacts(
            self._clock.instant_ns(instant),
            self._names,
            state.contacts.tolist(),
            state.pressure.tolist(),
        )


class Vision:
    """Tracks the object in the camera's images.

    The colour camera's frame is the world. A tracker that knows the hand gets the joints of the image's
    instant, not the newest. Looking for an object that is covered takes longer than an image may, so it
    is done in every other image, and the estimator goes on from touch at the full rate.

    Args:
        camera: The camera.
        tracker: Started at the object's pose.
        T_wh: Pose of the hand in the world.
        inputs: Where the visual poses go.
        clock: The run's clock.
        images: Whether images are recorded.
        calibration: What the robot's joints and camera are corrected with now.
        hint: Where the tracker is to look, too, by whether it saw the object last; None where it needs no telling.
        imager: The camera's left imager where the tracker is given its images; None: those of the colour camera.

    Attributes:
        images: Images looked at.
        image_ns: Instant of the last one [ns]; None before the first.
        lost: Images in which the object was not found, or not looked for.
        without_infrared: Images of the left imager without the infrared one of their instant.
        frame: The last images.
        trouble: Why there are no images now; empty where there are.
        silent: For how long there have been none in all [s], without the silence that lasts.
        odd_stamps: Images whose stamp cannot be right; they are left out.
    """

    def __init__(
        self,
        camera: Camera,
        tracker: DepthTracker,
        T_wh: gtsam.Pose3,
        inputs: Inputs,
        clock: RunClock,
        images: bool,
        calibration: Callable[[], Calibration | None] = lambda: None,
        hint: Callable[[bool], gtsam.Pose3 | None] = lambda seen: None,
        imager: LeftImager | None = None,
    ) -> None:
        self._camera = camera
        self._hint = hint
        self._calibration = calibration
        self._tracker = tracker
        self._imager = imager
        self._T_wh = T_wh
        self._inputs = inputs
        self._clock = clock
        self._record = images
        self.images = 0
        self.image_ns: int | None = None
        self.lost = 0
        self.without_infrared = 0
        self.trouble = ""
        self.silent = 0.0
        self.odd_stamps = 0
        self._age = 0.0  # [s], of the last image with an odd stamp
        self._silent_since: float | None = None
        self._seen = True  # the object, when it was last looked for
        self._rests = False  # leaves the next image alone
        self.frame: CameraFrame | None = None

    def run(self, stop: threading.Event, ended: Callable[[], None] = lambda: None) -> None:
        """Track until ``stop`` is set or a recording has ended.

        A camera that gives no images ends nothing: the estimator goes on from touch, and images count again when
        they come again.
        """
        while not stop.is_set():
            try:
                frame = self._camera.read()
            except CameraError as error:
                self._note_silence(str(error))
                stop.wait(_RETRY)
                continue
            if frame is None:
                self._note_silence(f"{self._camera.name} has ended")
                ended()
                return
            self._note_image()
            self._take(frame)

    def remarks(self) -> list[str]:
        """What people should hear of the camera; a line each."""
        lines = []
        silent = self.silent
        if self._silent_since is not None:
            silent += self._clock.now_ns() / 1e9 - self._silent_since
        if silent > 0.0:
            why = f": {self.trouble}" if self.trouble else ""
            lines.append(
                f"no images for {silent:.1f} s, where touch and the hand's shape went on alone{why}"
            )
        if self.without_infrared:
            lines.append(
                f"{self.without_infrared} images came without the infrared image of their instant: the object's "
                "outline was not looked for in them; is the camera on a USB 3 port of its own?"
            )
        if self.odd_stamps:
            lines.append(
                f"{self.odd_stamps} images left out: by their stamps they are from {_ago(self._age)}; "
                "did a clock jump? Switch the camera off and on, and let nothing set this computer's "
                "clock during a run"
            )
        return lines

    def _note_silence(self, why: str) -> None:
        if self._silent_since is None:
            self._silent_since = self._clock.now_ns() / 1e9
            log.warning("%s; going on from touch and the hand's shape alone", why)
        self.trouble = why

    def _note_image(self) -> None:
        if self._silent_since is not None:
            self.silent += self._clock.now_ns() / 1e9 - self._silent_since
            self._silent_since, self.trouble = None, ""
            log.warning("%s gives images again", self._camera.name)

    def _take(self, frame: CameraFrame) -> None:
        self.frame = frame
        instant_ns = self._clock.instant_ns(frame.time)
        age = (self._clock.now_ns() - instant_ns) / 1e9
        if not -0.01 <= age <= OLD:
            if not self.odd_stamps:
                log.warning("an image's stamp is from %s: left out; did a clock jump?", _ago(age))
            self.odd_stamps += 1
            self._age = age
            return
        joints = self._inputs.joints_at(instant_ns)
        if joints is None:
            return
        if self._record:
            self._record_images(instant_ns, frame)
        tracked = TrackedPose.lost() if self._rests else self._track(frame, joints)
        self._rests = tracked.T_wo is None and not self._rests
        if tracked.T_wo is None:
            self.lost += 1
        else:
            covariance, correlation = tracked.covariance, tracked.correlation
            self._inputs.put_vision(instant_ns, tracked.T_wo, covariance, correlation)
        self.images += 1
        self.image_ns = instant_ns

    def _track(self, frame: CameraFrame, joints: np.ndarray) -> TrackedPose:
        joints, T_wh = as_seen(self._calibration(), joints, self._T_wh)
        hint = self._hint(self._seen)
        if hint is not None:
            self._tracker.search_at(hint)
        depth, T_wc, infrared = self._shown(frame)
        beside = {} if infrared is None else {"infrared": infrared}
        tracked = self._tracker.update(depth, T_wc, joints, T_wh, **beside)
        self._seen = tracked.T_wo is not None
        return tracked

    def _shown(self, frame: CameraFrame) -> tuple[np.ndarray, gtsam.Pose3, np.ndarray | None]:
        """What the tracker is shown: depth [m], the pose of what measured it, its infrared image."""
        if self._imager is None:
            return frame.depth, gtsam.Pose3(), None
        assert frame.left is not None  # each frame of a camera with a left imager has them
        self.without_infrared += frame.left.infrared is None
        return frame.left.depth, self._imager.T_cd, frame.left.infrared

    def _record_images(self, instant_ns: int, frame: CameraFrame) -> None:
        recorder = self._inputs.recorder
        recorder.write_image("depth", instant_ns, frame.depth)
        if frame.color is not None:
            recorder.write_image("color", instant_ns, frame.color)


def _ago(age: float) -> str:
    return f"{age:.1f} s ago" if age >= 0 else f"{-age:.1f} s ahead"
