# SPDX-License-Identifier: MIT
"""The camera's part of a recording: images and intrinsics, read one at a time from the file."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from ..camera import CameraIntrinsics
from ..exceptions import RecordingError
from ..input.door import reading
from . import names
from .bags import open_source
from .images import decode_color, decode_depth
from .messages import CAMERA_INFO, COMPRESSED_IMAGE, stamp_ns


def depth_images(path: str | Path, topic: str = names.DEPTH) -> Iterator[tuple[float, np.ndarray]]:
    """Instants [s] and depth images [m], float32, shape (H, W), 0 where nothing was measured."""
    return _images(path, topic, decode_depth)


def color_images(path: str | Path, topic: str = names.COLOR) -> Iterator[tuple[float, np.ndarray]]:
    """Instants [s] and colour images, RGB, uint8, shape (H, W, 3)."""
    return _images(path, topic, decode_color)


def image_times(path: str | Path, topic: str | None = None) -> np.ndarray:
    """Instants of the images [s], shape (N,), increasing; of the colour ones where there are any.

    Args:
        path: The recording.
        topic: Another robot's topic of images, of whatever stamped type; None: our own.

    Raises:
        RecordingError: There is no such topic, or its messages have no stamps.
    """
    if topic is not None:
        return _stamps(path, topic)
    for name in (names.COLOR, names.DEPTH):
        stamps = {stamp for stamp, _ in _decoded(path, name, COMPRESSED_IMAGE)}
        if stamps:
            return np.array(sorted(stamps)) / 1e9
    return np.empty(0)


def _stamps(path: str | Path, topic: str) -> np.ndarray:
    """Stamps of any topic whose messages have them [s], increasing."""
    stamps: set[int] = set()
    for message in open_source(path).messages({topic}):
        with reading(f"topic {topic} of {path}", RecordingError):
            decoded = message.decode(message.data)
        if not hasattr(decoded, "header"):
            raise RecordingError(
                f"topic {topic} has type {message.msgtype}, which has no stamps; give the topic of the "
                "images as 'images' in the topic map"
            )
        with reading(f"topic {topic} of {path}", RecordingError):
            stamps.add(stamp_ns(decoded))
    if not stamps:
        raise RecordingError(f"{path} has no topic {topic} (images)")
    return np.array(sorted(stamps)) / 1e9


def camera_intrinsics(path: str | Path, topic: str = names.CAMERA_INFO) -> CameraIntrinsics | None:
    """The camera's intrinsics, or None where the recording has none."""
    for _, info in _decoded(path, topic, CAMERA_INFO):
        fx, _, cx, _, fy, cy = (float(value) for value in info.k[:6])
        return CameraIntrinsics(int(info.width), int(info.height), fx, fy, cx, cy)
    return None


def _images(
    path: str | Path, topic: str, decode: Callable[[bytes], np.ndarray]
) -> Iterator[tuple[float, np.ndarray]]:
    for stamp, message in _decoded(path, topic, COMPRESSED_IMAGE):
        try:
            image = decode(bytes(message.data))
        except (OSError, ValueError) as error:
            raise RecordingError(
                f"{path}: the image on {topic} at {stamp / 1e9:.3f} s cannot be read: {error}"
            ) from error
        yield stamp / 1e9, image


def _decoded(path: str | Path, topic: str, expected: str) -> Iterator[tuple[int, Any]]:
    """Stamps [ns] and messages of a topic in the file's order; large ones are not kept."""
    for message in open_source(path).messages({topic}):
        if message.msgtype != expected:
            raise RecordingError(f"topic {topic} has type {message.msgtype}, expected {expected}")
        with reading(f"topic {topic} of {path}", RecordingError):
            decoded = message.decode(message.data)
            stamp = stamp_ns(decoded)
        yield stamp, decoded
