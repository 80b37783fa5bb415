# SPDX-License-Identifier: MIT
"""Drawing MuJoCo scenes into images with OpenGL, without a display.

MuJoCo decides how to draw when it is first imported, by MUJOCO_GL. Here it is decided where something is to
be drawn, so that whoever imported it first does not matter.
"""

from __future__ import annotations

import os
from ctypes.util import find_library
from typing import TYPE_CHECKING, Any

import numpy as np

from vtgtsam.exceptions import VtgtsamError

if TYPE_CHECKING:
    import mujoco

SAMPLES = 4  # a pixel, against jagged edges


class NoGraphics(VtgtsamError):
    """Neither EGL nor OSMesa is there to draw with."""


class Canvas:
    """Draws one model into images of one size. Use it from one thread; close it, or use ``with``.

    Attributes:
        scene: What is drawn, to be filled by ``mujoco.mjv_updateScene`` or by the caller.

    Args:
        model: The model; what it says of the size of off-screen buffers is set here.
        width: Of the images [pixels].
        height: Of the images [pixels].
        max_geoms: Room in the scene.

    Raises:
        NoGraphics: There is nothing to draw with.
    """

    def __init__(
        self, model: mujoco.MjModel, width: int, height: int, max_geoms: int = 2000
    ) -> None:
        import mujoco

        self._gl: Any = _open(width, height)
        self._gl.make_current()
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        model.vis.quality.offsamples = SAMPLES
        self.scene = mujoco.MjvScene(model, maxgeom=max_geoms)
        self._context = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._context)
        self._view = mujoco.MjrRect(0, 0, width, height)
        self._image = np.empty((height, width, 3), dtype=np.uint8)

    def __enter__(self) -> Canvas:
        return self

    def __exit__(self, *exc_info: object) -> None:
        self.close()

    def draw(self) -> np.ndarray:
        """The scene as an image, RGB, uint8, shape (height, width, 3)."""
        import mujoco

        self._gl.make_current()  # another canvas may have been drawn on
        mujoco.mjr_render(self._view, self.scene, self._context)
        mujoco.mjr_readPixels(self._image, None, self._view, self._context)
        return np.ascontiguousarray(self._image[::-1])  # OpenGL's first row is the lowest

    def close(self) -> None:
        """Give the memory of the graphics driver back."""
        self._gl.make_current()
        self._context.free()
        self._gl.free()


def check_graphics() -> None:
    """Find out whether anything can be drawn, before much work is done.

    Raises:
        NoGraphics: It cannot.
    """
    _open(16, 16).free()


def _open(width: int, height: int) -> Any:
    """A context to draw in: by EGL, or else by OSMesa, or as MUJOCO_GL wants it."""
    reasons = []
    wanted = os.environ.get("MUJOCO_GL", "").lower()
    for library, make in (("EGL", _egl), ("OSMesa", _osmesa)):
        if wanted in ("egl", "osmesa") and wanted != library.lower():
            continue
        if not find_library(library):
            reasons.append(f"lib{library} is not installed")
            continue
        try:
            return make(width, height)
        except Exception as error:  # PyOpenGL and drivers raise anything, AttributeError too
            reasons.append(f"{library}: {error}")
    raise NoGraphics(
        f"pictures need EGL or OSMesa ({'; '.join(reasons)}); on Debian type: apt-get install "
        "libegl1 libegl-mesa0 libgl1-mesa-dri (or libosmesa6)"
    )


def _egl(width: int, height: int) -> Any:
    from mujoco.egl import GLContext

    return GLContext(width, height)


def _osmesa(width: int, height: int) -> Any:
    from mujoco.osmesa import GLContext

    return GLContext(width, height)
