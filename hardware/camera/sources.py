# SPDX-License-Identifier: MIT
"""Cameras by name, as a command's ``--camera`` gives them."""

from __future__ import annotations

from pathlib import Path

from .camera import Camera, CameraError


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
