# SPDX-License-Identifier: MIT
"""A film of a recording: the camera's view and the side's, side by side or one above the other."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

import numpy as np

from vtgtsam import read_recording
from vtgtsam.atomic import replacing

from .encode import encoder
from .instants import Estimated, instants
from .painter import Painter

FPS = {".mp4": 30.0, ".gif": 10.0, ".webp": 10.0}  # by suffix, where not asked for


def frames(
    path: Path,
    fps: float,
    speed: float,
    size: tuple[int, int],
    stacked: bool = False,
    estimates: Mapping[str, Estimated] | None = None,
) -> Iterator[np.ndarray]:
    """The film's pictures, RGB, uint8, shape (height, width, 3), height and width even.

    Args:
        path: The recording.
        fps: Pictures in a second of the film [Hz].
        speed: Seconds of the recording in a second of the film.
        size: Width and height of a view [pixels].
        stacked: Whether the camera's view is above the side's, else it is on the left.
        estimates: What methods made of it, to be shown beside the object, by name.

    Raises:
        RecordingError: The recording lacks what is to be shown.
        NoGraphics: There is nothing to draw with.
    """
    estimates, recording = estimates or {}, read_recording(path)
    shown = instants(recording, fps / speed, list(estimates.values()))
    methods = {name: estimated.method for name, estimated in estimates.items()}
    join = np.vstack if stacked else np.hstack
    with Painter(recording, shown, size, methods) as painter:
        for instant in shown:
            picture = painter.captioned(instant, join(painter.paint(instant)))
            yield picture[: picture.shape[0] // 2 * 2, : picture.shape[1] // 2 * 2]


def write_film(
    path: Path,
    out: Path,
    fps: float | None,
    speed: float,
    size: tuple[int, int],
    stacked: bool = False,
    estimates: Mapping[str, Estimated] | None = None,
) -> None:
    """Write a film as H.264 in .mp4, which every player shows, or as .gif or .webp for web pages."""
    fps = fps or FPS[out.suffix.lower()]
    encode = encoder(out.suffix.lower())  # before the work, in case it cannot
    with replacing(out) as temporary:
        encode(frames(path, fps, speed, size, stacked, estimates), temporary, fps)
