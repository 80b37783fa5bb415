# SPDX-License-Identifier: MIT
"""The left imager of a RealSense camera, by its factory calibration."""

from __future__ import annotations

import logging
from types import ModuleType
from typing import Any

import gtsam
import numpy as np

from vtgtsam.camera import CameraIntrinsics

from .imager import LeftImager

log = logging.getLogger(__name__)

LEFT = 1  # index of the left infrared stream; 2 is the right one's
_SAME = 0.1  # [pixels], by which the calibrations of depth and infrared image may differ


def left_imager(rs: ModuleType, profile: Any, name: str) -> LeftImager | None:
    """The left imager, or None where its infrared images are not streamed or cannot be used, with a warning.

    Args:
        rs: The RealSense library.
        profile: What streams; depth and colour are among it.
        name: The camera's.
    """
    infrared = next((s for s in profile.get_streams() if _is_left(rs, s)), None)
    if infrared is None:
        return None
    depth = profile.get_stream(rs.stream.depth).as_video_stream_profile()
    if why := _unusable(rs, infrared.as_video_stream_profile(), depth):
        log.warning("%s: the infrared image %s; going on without it", name, why)
        return None
    intrinsics = pinhole(depth.get_intrinsics())
    return LeftImager(
        intrinsics, pose(depth.get_extrinsics_to(profile.get_stream(rs.stream.color)))
    )


def pinhole(intrinsics: Any) -> CameraIntrinsics:
    """The library's intrinsics as ours, without its lens distortion."""
    i = intrinsics
    return CameraIntrinsics(i.width, i.height, i.fx, i.fy, i.ppx, i.ppy)


def pose(extrinsics: Any) -> gtsam.Pose3:
    """Pose T_to_from of extrinsics that take points of one stream to another's frame; they hold columns of R."""
    R = np.array(extrinsics.rotation, dtype=np.float64).reshape(3, 3).T
    return gtsam.Pose3(gtsam.Rot3.ClosestTo(R), np.array(extrinsics.translation, dtype=np.float64))


def _is_left(rs: ModuleType, stream: Any) -> bool:
    return bool(stream.stream_type() == rs.stream.infrared and stream.stream_index() == LEFT)


def _unusable(rs: ModuleType, infrared: Any, depth: Any) -> str:
    """Why an infrared image cannot be laid on the depth; empty where it can."""
    if infrared.format() != rs.format.y8:
        return f"is of format {infrared.format()}, expected 8 bit (y8)"
    seen, measured = infrared.get_intrinsics(), depth.get_intrinsics()
    if bent := next((list(i.coeffs) for i in (seen, measured) if any(i.coeffs)), None):
        return f"or the depth has lens distortion {bent}, which this program does not undo"
    sizes = [(i.width, i.height) for i in (seen, measured)]
    if sizes[0] != sizes[1]:
        (width, height), (across, down) = sizes
        return f"has {width} x {height} pixels, the depth {across} x {down}"
    numbers = [(i.fx, i.fy, i.ppx, i.ppy) for i in (seen, measured)]
    if np.abs(np.subtract(numbers[0], numbers[1])).max() > _SAME:
        return f"has other intrinsics than the depth: fx, fy, cx, cy {numbers[0]} and {numbers[1]}"
    return ""
