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


class CameraError(VtgtsamError):
    """No camera, no images from it, or images that cannot be used."""


@dataclass(frozen=True, eq=False)
class CameraFrame:
    """The images of one instant, both as the colour camera sees.

    Attributes:
        time: When they were taken [s], by the host's monotonic clock; by the recording's clock where
            a file is read as fast as it goes.
        depth: Depth along the optical axis [m], shape (H, W), float32, 0 where nothing was measured.
        color: RGB image, shape (H, W, 3), uint8, or None where the camera has none.
    """

    time: float
    depth: np.ndarray
    color: np.ndarray | None


class Camera(ABC):
    """A source of images; a context manager.

    Attributes:
        name: What it is, for people.
        intrinsics: Of both images.
    """

    name: str
    intrinsics: CameraIntrinsics

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
