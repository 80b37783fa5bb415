# SPDX-License-Identifier: MIT
"""The depth images of one sequence as a stereo camera measures them."""

from __future__ import annotations

from collections.abc import Iterator

import gtsam
import numpy as np

from vtgtsam.camera import CameraIntrinsics

from ..calibration import CalibrationError
from ..camera import MAX_RANGE
from ..observe import Noise, camera_pose, window
from ..replay import Replay
from ..simulate import Trajectory
from ..world import World
from . import rig
from .aligned import aligned
from .infrared import InfraredCamera
from .matching import Matcher, depth_of

BORDER = 8  # [pixels], matched around the part that is kept: the refinement's window reaches so far
EXPOSURE = 1000.0  # [gray levels], of a white surface in the middle of a dot, 0.6 m away
SHOT, READ = (
    0.35,
    1.2,
)  # noise [gray levels]: SHOT sqrt(brightness) and READ, the camera's gain at 16


class StereoVideo:
    """The two infrared images of each frame, ray cast once; noise is put on them as often as wanted.

    What was measured with one noise is kept until another is wanted: each robot that looks on sees the same.
    Attributes as in ``sim.observe.Video``; the depth camera is the left imager.
    """

    def __init__(self, world: World, trajectory: Trajectory) -> None:
        self.T_wc = camera_pose(world)
        self.camera = window(world, self.T_wc, rig.INFRARED)
        self.T_dc = rig.beside(gtsam.Pose3(), rig.COLOR)
        self.color_camera = window(world, self.T_wc * self.T_dc)
        right, self._inner = surrounding(self.camera)
        # The left image's first columns have no partner in the right one, whatever they show.
        left = right.cropped(rig.DISPARITIES, 0, right.width - rig.DISPARITIES, right.height)
        imagers = (
            InfraredCamera(world.model, left),
            InfraredCamera(world.model, right, rig.BASELINE),
        )
        replay = Replay(world.model, world.hand.joint_names)
        self._noise: Noise | None = None
        self._steps: list[np.ndarray] = []
        self._left: list[np.ndarray] = []
        self._clean = []
        for joints, T_wh, T_wo in zip(
            trajectory.frame_joints, trajectory.frame_T_wh, trajectory.frame_T_wo, strict=True
        ):
            replay.show(joints, T_wh, T_wo)
            left_image, right_image = (image.render(replay.data, self.T_wc) for image in imagers)
            pair = np.zeros((2, *right_image.shape), dtype=np.float16)  # to a tenth of a gray level
            pair[0, :, rig.DISPARITIES :], pair[1] = left_image, right_image
            self._clean.append(pair)

    def images(self, noise: Noise, error: CalibrationError) -> Iterator[np.ndarray]:
        """The depth images as measured [m], shape (height, width), 0 where nothing was.

        A camera that sees edges as a real one needs no errors put in at edges: those of ``error`` are not.
        """
        self._measure(noise)
        for steps in self._steps:
            disparity = steps * np.float32(rig.DISPARITY_STEP)
            yield depth_of(disparity, self.camera.fx, MAX_RANGE)

    def infrared(self, noise: Noise) -> Iterator[np.ndarray]:
        """The left images that the depth was measured from, of uint8 and its shape."""
        self._measure(noise)
        yield from self._left

    def _measure(self, noise: Noise) -> None:
        """Keep disparities, in the camera's steps (whole numbers), and the left images."""
        if self._noise == noise:
            return
        rng, matcher = np.random.default_rng(noise.seed), Matcher()
        self._noise, self._steps, self._left = noise, [], []
        for clean in self._clean:
            left, right = exposed(clean.astype(np.float32), rng, noise.scale)
            disparity = matcher.disparity(left, right)[self._inner]
            self._steps.append((disparity / rig.DISPARITY_STEP).astype(np.uint16))
            self._left.append(left[self._inner].copy())

    def aligned(self, depth: np.ndarray) -> np.ndarray:
        """A depth image [m] as the colour camera would have it."""
        return aligned(depth, self.camera, self.color_camera, self.T_dc)


def surrounding(camera: CameraIntrinsics) -> tuple[CameraIntrinsics, tuple[slice, slice]]:
    """The part of the imager to match for a part's depth, and where that part lies in it.

    On the left it is wider by all disparities: what has no partner in the right image is not measured there.
    """
    whole = rig.INFRARED
    x, y = round(whole.cx - camera.cx), round(whole.cy - camera.cy)
    left, top = max(x - rig.DISPARITIES - BORDER, 0), max(y - BORDER, 0)
    right = min(x + camera.width + BORDER, whole.width)
    bottom = min(y + camera.height + BORDER, whole.height)
    inner = (
        slice(y - top, y - top + camera.height),
        slice(x - left, x - left + camera.width),
    )
    return whole.cropped(left, top, right - left, bottom - top), inner


def exposed(brightness: np.ndarray, rng: np.random.Generator, scale: float) -> np.ndarray:
    """Images of uint8 of a brightness, any shape, with the imager's noise times ``scale``."""
    gray = EXPOSURE * brightness
    sigma = scale * np.sqrt(READ**2 + SHOT**2 * gray)
    noisy = gray + sigma * rng.standard_normal(gray.shape, dtype=np.float32)
    return np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
