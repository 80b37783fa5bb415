# SPDX-License-Identifier: MIT
"""Draws instants of a recording: the camera's view and the side's, with a line of words."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import mujoco
import numpy as np
from PIL import Image, ImageDraw, ImageFont

from vtgtsam import Recording

from ..graphics import Canvas
from .instants import Instant
from .stage import TOUCHING, TRUTH, Stage, method_color
from .views import View, find_views

PAPER, INK, FAINT = (250, 251, 252), (38, 44, 52), (120, 128, 138)
FRAMED = 12  # instants of which the extent is looked at to find the views


class Painter:
    """Draws instants of one recording; use it in a ``with`` statement.

    Args:
        recording: The recording.
        instants: All that is going to be drawn, so that it can be brought into sight.
        size: Width and height of one view [pixels].
        methods: The methods whose estimates are shown, by the names that the caption has for them.

    Raises:
        NoGraphics: There is nothing to draw with.
    """

    def __init__(
        self,
        recording: Recording,
        instants: Sequence[Instant],
        size: tuple[int, int],
        methods: Mapping[str, str] | None = None,
    ) -> None:
        methods = methods or {}
        self._colors = {name: method_color(m, k) for k, (name, m) in enumerate(methods.items())}
        self._stage = Stage(recording, list(self._colors.values()))
        self._size = size
        chosen = np.unique(np.linspace(0, len(instants) - 1, FRAMED).astype(int))
        points = np.concatenate([self._stage.extent(instants[k]) for k in chosen])
        self._stage.light((points.min(axis=0) + points.max(axis=0)) / 2)
        self._views = find_views(points, recording.camera_pose, size[0] / size[1])
        self._options = mujoco.MjvOption()
        self._options.sitegroup[:] = 0  # pads are drawn as the geoms that touch, not as sites
        self._canvas = Canvas(self._stage.model, *size)

    def __enter__(self) -> Painter:
        return self

    def __exit__(self, *exc_info: object) -> None:
        self._canvas.close()

    def paint(self, instant: Instant) -> tuple[np.ndarray, np.ndarray]:
        """The camera's view and the side's, each (height, width, 3), uint8."""
        self._stage.show(instant)
        front, side = (self._paint(view) for view in self._views)
        return front, side

    def _paint(self, view: View) -> np.ndarray:
        stage, canvas = self._stage, self._canvas
        stage.model.vis.global_.fovy = view.fovy
        mujoco.mjv_updateScene(
            stage.model,
            stage.data,
            self._options,
            mujoco.MjvPerturb(),
            view.camera(),
            mujoco.mjtCatBit.mjCAT_ALL,
            canvas.scene,
        )
        stage.finish(canvas.scene)
        return canvas.draw()

    def captioned(self, instant: Instant, pictures: np.ndarray) -> np.ndarray:
        """Pictures (height, width, 3) with a line below that says time, phase and contacts."""
        height = max(16, self._size[1] // 12)
        line = Image.new("RGB", (pictures.shape[1], height), PAPER)
        draw, words, gap = ImageDraw.Draw(line), self._words(instant), height / 2
        font = ImageFont.load_default(round(height * 0.62))
        room = sum(draw.textlength(text, font=font) + gap for text, _ in words) + gap
        if room > line.width:
            font = ImageFont.load_default(int(height * 0.62 * line.width / room))
            gap *= line.width / room
        x = gap
        for text, color in words:
            draw.text((x, height / 2), text, fill=color, font=font, anchor="lm")
            x += draw.textlength(text, font=font) + gap
        return np.vstack([pictures, np.asarray(line)])

    def _words(self, instant: Instant) -> list[tuple[str, tuple[int, ...]]]:
        """The caption's words with their colours."""
        touching = int(np.count_nonzero(instant.contacts))
        pads = "1 pad touches" if touching == 1 else f"{touching} pads touch"
        words = [
            (f"{instant.time:4.1f} s", INK),
            (instant.phase, FAINT),
            (pads, _bytes(TOUCHING, 0.85) if touching else FAINT),
        ]
        if self._colors:
            words.append(("truth", _bytes(TRUTH, 0.8)))
        for (name, color), T in zip(self._colors.items(), instant.estimates, strict=True):
            words.append((name if T is not None else f"{name}: no pose", _bytes(color, 0.9)))
        return words


def _bytes(color: Sequence[float], factor: float) -> tuple[int, ...]:
    return tuple(round(255 * factor * c) for c in color)
