# SPDX-License-Identifier: MIT
"""Recorded images as a camera: those of our own recordings, and any recording at its own pace."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from vtgtsam.recording.camera import camera_intrinsics, color_images, depth_images

from .camera import Camera, CameraError, CameraFrame

_APART = 0.020  # [s], stamps of a depth and a colour image that belong together
_KEPT = 0.1  # [s], how long an image waits to be asked for


class RecordedCamera(Camera):
    """The images of a recording (MCAP or rosbag2), read as fast as they are asked for."""

    def __init__(self, path: str | Path) -> None:
        """Open the recording.

        Raises:
            CameraError: It has no intrinsics on /camera/info.
            RecordingError: It cannot be read.
        """
        intrinsics = camera_intrinsics(path)
        if intrinsics is None:
            raise CameraError(
                f"{path} has no message on /camera/info: it was recorded without images"
            )
        self.name = str(path)
        self.intrinsics = intrinsics
        self._depth = depth_images(path)
        self._color = _Held(color_images(path))

    def read(self) -> CameraFrame | None:
        """The next images, or None at the end.

        Raises:
            CameraError: An image has another size than /camera/info says.
            RecordingError: The recording cannot be read.
        """
        stamp, depth = next(self._depth, (0.0, None))
        if depth is None:
            return None
        expected = (self.intrinsics.height, self.intrinsics.width)
        if depth.shape != expected:
            raise CameraError(
                f"{self.name}: the depth image at {stamp:.3f} s has shape {depth.shape}, "
                f"/camera/info says {expected}"
            )
        return CameraFrame(stamp, depth, self._color.at(stamp))

    def close(self) -> None:
        """Let go of the file."""
        self._depth = iter(())
        self._color = _Held(iter(()))


class _Held:
    """Finds the colour image of each depth image; both come in the order of their stamps."""

    def __init__(self, images: Iterator[tuple[float, np.ndarray]]) -> None:
        self._images = images
        self._next: tuple[float, np.ndarray] | None = next(images, None)

    def at(self, stamp: float) -> np.ndarray | None:
        while self._next is not None and self._next[0] < stamp - _APART:
            self._next = next(self._images, None)
        if self._next is None or self._next[0] > stamp + _APART:
            return None
        return self._next[1]


class PacedCamera(Camera):
    """Another camera's images at the pace at which they were taken, stamped as if taken now.

    Images that are asked for too late come at once, with the stamp at which they were due; those that
    nobody has asked for in 0.1 s are gone, as with a real camera.
    """

    def __init__(
        self,
        camera: Camera,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        """Start with the first image.

        Args:
            camera: A recording.
            clock: The host's monotonic clock [s].
            sleep: Waits for some time [s].
        """
        self.name = camera.name
        self.intrinsics = camera.intrinsics
        self.left = camera.left
        self._camera = camera
        self._clock = clock
        self._sleep = sleep
        self._offset: float | None = None  # [s], from the recording's clock to ours

    def read(self) -> CameraFrame | None:
        """The next images when they are due, or None at the end."""
        while (frame := self._camera.read()) is not None:
            now = self._clock()
            if self._offset is None:
                self._offset = now - frame.time
            due = frame.time + self._offset
            if due > now:
                self._sleep(due - now)
            if due >= now - _KEPT:
                return replace(frame, time=due)
        return None

    def close(self) -> None:
        """Close the recording."""
        self._camera.close()
