# SPDX-License-Identifier: MIT
"""Films as files."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vtgtsam.exceptions import VtgtsamError

if TYPE_CHECKING:
    from PIL import Image

Pictures = Iterator[np.ndarray]  # RGB, uint8, (height, width, 3), all of one size
Encoder = Callable[[Pictures, Path, float], None]  # pictures, the file to write, pictures a second

QUALITY = 23  # of H.264, its constant rate factor: 18 is without visible loss, 28 is coarse
COLORS = 128  # of a GIF
WEBP_QUALITY = 70


class NoEncoder(VtgtsamError):
    """The library that encodes films is not installed."""


def encoder(suffix: str) -> Encoder:
    """What writes files of that kind: .mp4, .gif or .webp.

    Raises:
        NoEncoder: A library is missing.
    """
    if suffix == ".mp4":
        try:
            import imageio_ffmpeg  # noqa: F401
        except ImportError:
            raise NoEncoder(
                "films as .mp4 need imageio-ffmpeg; type: pip install imageio-ffmpeg "
                "(or write a .gif or .webp)"
            ) from None
        return write_mp4
    return {".gif": write_gif, ".webp": write_webp}[suffix]


def write_mp4(pictures: Pictures, out: Path, fps: float) -> None:
    """H.264, yuv420p, with the index in front so that it plays while it loads."""
    import imageio_ffmpeg

    first = next(pictures)
    height, width, _ = first.shape
    writer = imageio_ffmpeg.write_frames(
        str(out),
        (width, height),
        fps=fps,
        codec="libx264",
        pix_fmt_out="yuv420p",
        quality=None,
        macro_block_size=2,
        output_params=["-crf", str(QUALITY), "-movflags", "+faststart", "-f", "mp4"],
        ffmpeg_log_level="error",
    )
    writer.send(None)
    try:
        writer.send(np.ascontiguousarray(first))
        for picture in pictures:
            writer.send(np.ascontiguousarray(picture))
    finally:
        writer.close()


def write_gif(pictures: Pictures, out: Path, fps: float) -> None:
    """A GIF that repeats, all pictures in the same colours, so that only what moves is stored."""
    from PIL import Image

    images = [Image.fromarray(picture) for picture in pictures]
    palette = _palette(images)
    reduced = [im.quantize(palette=palette, dither=Image.Dither.NONE) for im in images]
    reduced[0].save(
        out,
        "GIF",
        save_all=True,
        append_images=reduced[1:],
        duration=round(1000 / fps / 10) * 10,  # [ms]; GIF counts hundredths of a second
        loop=0,
        optimize=False,
    )


def _palette(images: Sequence[Image.Image]) -> Image.Image:
    """The colours of a sample of the pictures."""
    from PIL import Image

    sample = images[:: max(1, len(images) // 8)]
    sheet = Image.fromarray(np.vstack([np.asarray(image) for image in sample]))
    return sheet.quantize(COLORS, method=Image.Quantize.MEDIANCUT)


def write_webp(pictures: Pictures, out: Path, fps: float) -> None:
    """An animated WebP that repeats, smaller than a GIF and in all colours."""
    from PIL import Image

    first, *rest = [Image.fromarray(picture) for picture in pictures]
    first.save(
        out,
        "WEBP",
        save_all=True,
        append_images=rest,
        duration=round(1000 / fps),
        loop=0,
        quality=WEBP_QUALITY,
        method=4,
    )
