# SPDX-License-Identifier: MIT
"""What every camera here gives, whether real, from a file, or emulated."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np

from vtgtsam.camera import CameraIntrinsics
from vtgtsam.exceptions import VtgtsamError

from .imager import LeftImager, LeftImages


class CameraError(VtgtsamError):
    """No camera, no images from it, or images that cannot be used."""


@dataclass(frozen=True, eq=False)
class CameraFrame:
    """The images of one instant, as the colour camera sees, and those of a left imager beside them.

    Attributes:
        time: When they were taken [s], by the host's monotonic clock; by the recording's clock where
            a file is read as fast as it goes.
        depth: Depth along the optical axis [m], shape (H, W), float32, 0 where nothing was measured.
        color: RGB image, shape (H, W, 3), uint8, or None where the camera has none.
        left: The same depth before it was aligned to the colour image, and the infrared image that belongs to it,
            from a camera with a left imager; else None.
    """

    time: float
    depth: np.ndarray
    color: np.ndarray | None
    left: LeftImages | None = None


class Camera(ABC):
    """A source of images; a context manager.

    Attributes:
        name: What it is, for people.
        intrinsics: Of depth and colour image.
        left: The left imager of a stereo camera, whose images come with each frame; None where it has none, or no
            infrared images of it.
    """

    name: str
    intrinsics: CameraIntrinsics
    left: LeftImager | None = None

    @abstractmethod
    def read(self) -> CameraFrame | None:
        """The next images; waits for them. None when a recording has ended.

        Raises:
            CameraError: None came in time.
        """

    @abstractmethod
    def close(self) -> None:
        """Let go of the device or file."""

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self.close()


def open_camera(source: str) -> Camera:
    """The camera of that name.

    Args:
        source: "realsense", "realsense:SERIAL", or the path of a recording: .mcap or a rosbag2
            folder, or .db3 or .bag of the RealSense tools. Recordings play at their own pace.

    Raises:
        CameraError: There is no such camera.
        RecordingError: The recording cannot be read.
    """
    from .playback import PacedCamera, RecordedCamera
    from .realsense import RealSenseCamera, RealSenseFile

    kind, _, serial = source.partition(":")
    if kind == "realsense":
        return RealSenseCamera(serial or None)
    path = Path(source)
    if not path.exists():
        raise CameraError(
            f"no camera {source!r}: give realsense, realsense:SERIAL, or a recording's path"
        )
    if path.suffix in (".db3", ".bag"):
        return PacedCamera(RealSenseFile(path))
    return PacedCamera(RecordedCamera(path))
