# SPDX-License-Identifier: MIT
"""A method's colour, the same in figures, report, viewer and films; the truth is grey.

Colours that the colour-blind tell apart (Okabe and Ito, 2008), as "#rrggbb".
"""

from __future__ import annotations

TRUTH = "#A8ADB4"
OF_METHODS = {
    "vis": "#D55E00",
    "vis+pen": "#009E73",
    "vis+tac+pen": "#56B4E9",
    "vis+tac+pen+mem": "#0072B2",
}
OTHERS = ("#CC79A7", "#E69F00", "#000000")


def rgb(color: str) -> tuple[int, int, int]:
    """A colour's red, green and blue, 0 to 255."""
    red, green, blue = (int(color[i : i + 2], 16) for i in (1, 3, 5))
    return red, green, blue
