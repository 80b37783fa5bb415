# SPDX-License-Identifier: MIT
"""Pictures of a recorded sequence, from the camera and from the side, pads in contact lit up."""

from __future__ import annotations

import os
from ctypes.util import find_library
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vtgtsam import Recording, read_recording
from vtgtsam.exceptions import RecordingError, VtgtsamError

if TYPE_CHECKING:
    import mujoco

TOUCHING = (1.0, 0.75, 0.1, 1.0)  # RGBA of a pad in contact
FREE = (0.25, 0.3, 0.38, 1.0)
SIZE = (480, 360)  # [pixels], of one picture
ZOOM = 20.0  # [deg], field of view: hand and object fill it
HEIGHT = 0.06  # [m], of what both views look at, above the open palm
SIDE = (-0.35, -0.85, 0.4)  # direction of the side's view, from hand to camera
SIDE_DISTANCE = 1.0  # [m]
BACKGROUND = 245  # gray level where there is nothing


class NoGraphics(VtgtsamError):
    """Neither EGL nor OSMesa is there to draw with."""


@dataclass(frozen=True)
class Instant:
    """What one picture shows.

    Attributes:
        time: Instant since the first frame [s].
        joints: Joint angles in the hand's order [rad].
        T_wh: Pose of the hand, (4, 4).
        T_wo: True pose of the object, (4, 4).
        contacts: Which pads touch, (K,).
    """

    time: float
    joints: np.ndarray
    T_wh: np.ndarray
    T_wo: np.ndarray
    contacts: np.ndarray


def contact_sheet(path: Path, columns: int = 4) -> np.ndarray:
    """Both views at evenly spaced instants, side by side: the camera's above, the side's below.

    Args:
        path: A recording of the simulator, with ground truth.
        columns: Number of instants.

    Returns:
        Image (2 * height, columns * width, 3), uint8.

    Raises:
        RecordingError: The recording lacks the truth, or its hand is not one the simulator knows.
        NoGraphics: There is nothing to draw with.
    """
    _choose_graphics()
    recording = read_recording(path)
    with _Painter(recording) as painter:
        pictures = [painter.paint(instant) for instant in _instants(recording, columns)]
    return np.hstack([np.vstack(pair) for pair in pictures])


def save_png(image: np.ndarray, path: Path) -> None:
    """Write an image (height, width, 3), uint8, as PNG."""
    from PIL import Image

    Image.fromarray(image).save(path)


def _instants(recording: Recording, count: int) -> list[Instant]:
    measurements = list(recording.measurements("vision"))
    chosen = [measurements[i] for i in np.linspace(0, len(measurements) - 1, count).astype(int)]
    truth = recording.truth_at(np.array([m.time for m in chosen]))
    if truth is None or any(T_wo is None for T_wo in truth):
        raise RecordingError(f"{recording.path} has no true object poses, which pictures need")
    start = measurements[0].time
    return [
        Instant(
            m.time - start,
            recording.hand.joint_array(m.joints),
            m.T_wh.matrix(),
            T_wo.matrix(),
            np.asarray(m.contacts),
        )
        for m, T_wo in zip(chosen, truth, strict=True)
    ]


class _Painter:
    """Draws instants of one recording."""

    def __init__(self, recording: Recording) -> None:
        import mujoco

        from .description import load_description
        from .replay import Replay
        from .scene import CAMERA, build, pad_geom

        description = load_description(recording.info.get("hand", "isyhand"))
        hand = recording.hand
        self.replay = Replay(build(description, hand, recording.object), hand.joint_names)
        model = self.replay.model
        model.vis.global_.offwidth, model.vis.global_.offheight = SIZE
        model.vis.global_.fovy = ZOOM
        self._pads = [model.geom(pad_geom(name)).id for name in hand.pad_names]
        middle = description.palm.level() @ description.palm.center + (0.0, 0.0, HEIGHT)
        front = _orbit(middle, model.camera(CAMERA).pos)
        side = _orbit(middle, middle + SIDE_DISTANCE * np.array(SIDE))
        self._views = (front, side)
        self._options = mujoco.MjvOption()
        self._options.sitegroup[:] = 0  # pads are drawn as the geoms that touch, not as sites
        self._renderer = mujoco.Renderer(model, height=SIZE[1], width=SIZE[0])

    def __enter__(self) -> _Painter:
        return self

    def __exit__(self, *exc_info: object) -> None:
        self._renderer.close()

    def paint(self, instant: Instant) -> tuple[np.ndarray, np.ndarray]:
        """The camera's view and the side's."""
        import mujoco

        model, data = self.replay.model, self.replay.data
        self.replay.show(instant.joints, instant.T_wh, instant.T_wo)
        mujoco.mj_camlight(model, data)
        model.geom_rgba[self._pads] = np.where(instant.contacts[:, None], TOUCHING, FREE)
        views = []
        for camera in self._views:
            self._renderer.update_scene(data, camera, self._options)
            view = self._renderer.render().copy()
            view[(view == 0).all(axis=-1)] = BACKGROUND
            views.append(view)
        return views[0], views[1]


def _orbit(target: np.ndarray, position: np.ndarray) -> mujoco.MjvCamera:
    """A camera at ``position`` that looks at ``target``, z up."""
    import mujoco

    camera = mujoco.MjvCamera()
    forward = target - position
    camera.lookat[:] = target
    camera.distance = np.linalg.norm(forward)
    camera.azimuth = np.rad2deg(np.arctan2(forward[1], forward[0]))
    camera.elevation = np.rad2deg(np.arcsin(forward[2] / camera.distance))
    return camera


def _choose_graphics() -> None:
    """Tell MuJoCo, before it is imported, to draw with what needs no display."""
    for backend, library in (("egl", "EGL"), ("osmesa", "OSMesa")):
        if find_library(library):
            os.environ.setdefault("MUJOCO_GL", backend)
            return
    if "MUJOCO_GL" not in os.environ:
        raise NoGraphics(
            "pictures need EGL or OSMesa; on Debian type: apt-get install libegl1 libegl-mesa0 "
            "libgl1-mesa-dri (or libosmesa6)"
        )
