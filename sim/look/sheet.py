# SPDX-License-Identifier: MIT
"""A sheet of pictures: some instants side by side, the camera's view above, the side's below."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import numpy as np

from vtgtsam import read_recording
from vtgtsam.atomic import replacing

from .instants import Estimated, instants
from .painter import Painter

RATE = 20.0  # [Hz], fine enough to choose instants from


def contact_sheet(
    path: Path,
    columns: int,
    size: tuple[int, int],
    estimates: Mapping[str, Estimated] | None = None,
) -> np.ndarray:
    """Both views of evenly spaced instants, RGB, uint8.

    Args:
        path: The recording.
        columns: Number of instants.
        size: Width and height of a view [pixels].
        estimates: What methods made of it, to be shown beside the object, by name.

    Raises:
        RecordingError: The recording lacks what is to be shown.
        NoGraphics: There is nothing to draw with.
    """
    estimates, recording = estimates or {}, read_recording(path)
    every = instants(recording, RATE, list(estimates.values()))
    chosen = [every[k] for k in np.linspace(0, len(every) - 1, columns).astype(int)]
    methods = {name: estimated.method for name, estimated in estimates.items()}
    with Painter(recording, chosen, size, methods) as painter:
        pairs = [painter.captioned(i, np.vstack(painter.paint(i))) for i in chosen]
    return np.hstack(pairs)


def write_sheet(
    path: Path,
    out: Path,
    columns: int,
    size: tuple[int, int],
    estimates: Mapping[str, Estimated] | None = None,
) -> None:
    """Write ``contact_sheet`` as PNG."""
    from PIL import Image

    picture = Image.fromarray(contact_sheet(path, columns, size, estimates))
    with replacing(out) as temporary:
        picture.save(temporary, format="PNG", optimize=True)
