# SPDX-License-Identifier: MIT
"""What objects look like: a colour for each, since most meshes come without."""

from __future__ import annotations

import zlib

from vtgtsam.evaluation.palette import rgb

Color = tuple[float, float, float]  # red, green, blue in [0, 1]

# By a word in the object's name; the first that occurs counts.
_BY_WORD: dict[str, Color] = {
    "banana": (0.93, 0.78, 0.22),
    "lemon": (0.95, 0.85, 0.25),
    "pear": (0.66, 0.74, 0.28),
    "apple": (0.72, 0.16, 0.14),
    "orange": (0.93, 0.50, 0.13),
    "peach": (0.93, 0.62, 0.42),
    "plum": (0.42, 0.18, 0.36),
    "strawberry": (0.82, 0.13, 0.18),
    "baseball": (0.90, 0.88, 0.82),
    "tennis": (0.78, 0.85, 0.25),
    "golf": (0.92, 0.92, 0.92),
    "mustard": (0.93, 0.74, 0.13),
    "bottle": (0.28, 0.58, 0.42),
    "mug": (0.20, 0.44, 0.68),
    "meat_can": (0.24, 0.38, 0.66),
    "tuna": (0.30, 0.52, 0.72),
    "can": (0.80, 0.26, 0.20),
    "pudding": (0.45, 0.29, 0.20),
    "gelatin": (0.78, 0.26, 0.30),
    "sugar": (0.88, 0.76, 0.32),
    "cracker": (0.78, 0.22, 0.18),
    "box": (0.25, 0.45, 0.70),
    "brick": (0.62, 0.27, 0.20),
    "sponge": (0.85, 0.75, 0.35),
    "padlock": (0.72, 0.60, 0.30),
    "bowl": (0.72, 0.24, 0.22),
    "cup": (0.25, 0.55, 0.70),
}
_OTHERS: tuple[Color, ...] = (
    (0.22, 0.48, 0.72),
    (0.30, 0.60, 0.55),
    (0.55, 0.42, 0.68),
)


def of_palette(color: str) -> Color:
    """A colour of ``vtgtsam.evaluation.palette``, in [0, 1]."""
    red, green, blue = rgb(color)
    return red / 255, green / 255, blue / 255


def color_of(name: str) -> Color:
    """Colour of an object, always the same for one name."""
    for word, color in _BY_WORD.items():
        if word in name:
            return color
    return _OTHERS[zlib.crc32(name.encode()) % len(_OTHERS)]
