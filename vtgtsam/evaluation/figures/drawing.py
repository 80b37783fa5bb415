# SPDX-License-Identifier: MIT
"""A figure with the words that belong to it, and how it becomes a file."""

from __future__ import annotations

import io
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from ...atomic import replacing

DPI = 200


@dataclass(frozen=True)
class Drawing:
    """A figure and its words.

    Attributes:
        name: File name without its ending.
        caption: What it shows and how to read it.
        alt: What someone who cannot see it should be told: the numbers that matter.
        figure: The figure, which belongs to no window.
    """

    name: str
    caption: str
    alt: str
    figure: Figure


@dataclass(frozen=True)
class Picture:
    """A finished figure: its SVG text, its size on a screen [px], and its words."""

    name: str
    caption: str
    alt: str
    svg: str
    width: int
    height: int


def save(drawing: Drawing, path: Path) -> Picture:
    """Write the figure as PNG, and give it as SVG for the page."""
    with replacing(path) as temporary:
        drawing.figure.savefig(temporary, format="png", dpi=DPI, metadata={"Software": None})
    svg = io.StringIO()
    drawing.figure.savefig(svg, format="svg", metadata={"Date": None, "Creator": None})
    width, height = (round(96 * inches) for inches in drawing.figure.get_size_inches())
    return Picture(drawing.name, drawing.caption, drawing.alt, svg.getvalue(), width, height)
