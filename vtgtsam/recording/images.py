# SPDX-License-Identifier: MIT
"""Images as they are stored: depth in millimetres as a 16 bit PNG, colour as JPEG."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

import numpy as np

from .. import limits
from ..exceptions import RecordingError

if TYPE_CHECKING:
    from PIL import Image

MAX_MILLIMETRES = np.iinfo(np.uint16).max


def encode_depth(depth: np.ndarray) -> bytes:
    """PNG of a depth image [m], shape (H, W), in whole millimetres.

    Pixels that are not finite, not positive or beyond 65.535 m become 0, no depth.
    """
    from PIL import Image

    depth = np.asarray(depth, dtype=np.float64)
    if depth.ndim != 2:
        raise ValueError(f"a depth image must have shape (H, W), got {depth.shape}")
    millimetres = np.rint(np.nan_to_num(depth * 1e3, nan=0.0, posinf=0.0, neginf=0.0))
    millimetres[(millimetres < 0) | (millimetres > MAX_MILLIMETRES)] = 0
    png = io.BytesIO()
    # Level 1: sensor noise hardly compresses, and higher levels take several times as long.
    Image.fromarray(millimetres.astype(np.uint16)).save(png, "PNG", compress_level=1)
    return png.getvalue()


def decode_depth(png: bytes) -> np.ndarray:
    """Depth image [m], float32, shape (H, W); 0 where there is no depth."""
    from PIL import Image

    millimetres = np.asarray(_checked(Image.open(io.BytesIO(png))), dtype=np.float32)
    if millimetres.ndim != 2:
        raise ValueError(f"a depth image has one channel, this one has shape {millimetres.shape}")
    return millimetres / np.float32(1e3)


def encode_color(image: np.ndarray) -> bytes:
    """JPEG of a colour image, RGB, uint8, shape (H, W, 3)."""
    from PIL import Image

    image = np.asarray(image)
    if image.dtype != np.uint8 or image.ndim != 3 or image.shape[2] != 3:
        raise ValueError(
            f"a colour image must be uint8 of shape (H, W, 3), got {image.dtype} {image.shape}"
        )
    jpeg = io.BytesIO()
    Image.fromarray(image).save(jpeg, "JPEG", quality=90)
    return jpeg.getvalue()


def decode_color(data: bytes) -> np.ndarray:
    """Colour image, RGB, uint8, shape (H, W, 3), of a JPEG or PNG file."""
    from PIL import Image

    return np.array(_checked(Image.open(io.BytesIO(data))).convert("RGB"))


def _checked(image: Image.Image) -> Image.Image:
    """The image, of which so far only the header was read."""
    limits.check(image.width * image.height, limits.PIXELS, "pixels of one image", RecordingError)
    return image
