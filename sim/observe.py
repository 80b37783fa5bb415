# SPDX-License-Identifier: MIT
"""What the camera sees of a simulated sequence: depth images of the part of its image with the hand.

The images are the window of the D435's 640 x 480 image in which hand and object stay; the rest shows nothing
that a tracker could use, and leaving it out saves most of the ray casting.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Protocol

import gtsam
import numpy as np

from vtgtsam.camera import CameraIntrinsics

from .calibration import CalibrationError
from .camera import D435, DepthCamera, add_depth_noise
from .replay import Replay
from .scene import CAMERA
from .simulate import Trajectory
from .world import World

REACH = (
    0.13,
    0.17,
)  # [m], hand and object stay so close to the palm's centre, in the image's x and y


def camera_pose(world: World) -> gtsam.Pose3:
    """Pose T_wc of the scene's camera: x right, y down, z forward."""
    camera = world.model.camera(CAMERA)
    y_up = np.asarray(camera.mat0).reshape(3, 3)  # MuJoCo's cameras look along -z with y up
    return gtsam.Pose3(gtsam.Rot3(y_up @ np.diag([1.0, -1.0, -1.0])), np.array(camera.pos))


def window(world: World, T_wc: gtsam.Pose3, camera: CameraIntrinsics = D435) -> CameraIntrinsics:
    """The part of a camera's image that shows what is within ``REACH`` of the palm's centre."""
    palm = world.description.palm
    center_c = T_wc.transformTo(palm.level() @ palm.center)
    u, v = camera.project(center_c[None])[0]
    half_u, half_v = np.array(REACH) / (center_c[2] - np.array(REACH)) * (camera.fx, camera.fy)
    left, right = np.clip([u - half_u, u + half_u], 0, camera.width).astype(int).tolist()
    top, bottom = np.clip([v - half_v, v + half_v], 0, camera.height).astype(int).tolist()
    return camera.cropped(left, top, right - left, bottom - top)


@dataclass(frozen=True)
class Noise:
    """The camera's noise in one recording.

    Attributes:
        scale: Factor on the paper's standard deviations.
        seed: The same seed gives the same noise, in units of the standard deviation, at each scale.
    """

    scale: float
    seed: np.random.SeedSequence


class Video(Protocol):
    """The depth images of one trajectory.

    Attributes:
        camera: Intrinsics of the images.
        T_wc: The camera's true pose.
        color_camera: Intrinsics of the colour camera that looks the same way.
        T_dc: Its pose in the depth camera's frame.
    """

    camera: CameraIntrinsics
    T_wc: gtsam.Pose3
    color_camera: CameraIntrinsics
    T_dc: gtsam.Pose3

    def images(self, noise: Noise, error: CalibrationError) -> Iterator[np.ndarray]:
        """The images as measured [m], shape (height, width), 0 where nothing was."""
        ...

    def infrared(self, noise: Noise) -> Iterator[np.ndarray | None]:
        """The infrared images that show the same pixels, of uint8, same shape; None for a camera without."""
        ...

    def aligned(self, depth: np.ndarray) -> np.ndarray:
        """One of them as the colour camera would have it [m]."""
        ...


class DepthVideo:
    """The paper's: exact depth in the colour camera's frame, and noise of each pixel's own.

    The images are ray cast once; noise is put on them as often as wanted. Attributes as in ``Video``.
    """

    def __init__(self, world: World, trajectory: Trajectory) -> None:
        self.T_wc = camera_pose(world)
        self.camera = self.color_camera = window(world, self.T_wc)
        self.T_dc = gtsam.Pose3()
        replay = Replay(world.model, world.hand.joint_names)
        depth_camera = DepthCamera(world.model, self.camera)
        self._clean = []
        for joints, T_wh, T_wo in zip(
            trajectory.frame_joints, trajectory.frame_T_wh, trajectory.frame_T_wo, strict=True
        ):
            replay.show(joints, T_wh, T_wo)
            depth, _ = depth_camera.render(replay.data, self.T_wc)
            self._clean.append(depth.astype(np.float32))  # good to 0.1 um at 1 m

    def images(self, noise: Noise, error: CalibrationError) -> Iterator[np.ndarray]:
        """The images as measured [m], shape (height, width), 0 where nothing was."""
        rng = np.random.default_rng(noise.seed)
        for clean in self._clean:
            image = error.spoil_depth(clean.astype(np.float64), rng)
            yield add_depth_noise(image, rng, noise.scale)

    def infrared(self, noise: Noise) -> Iterator[None]:
        """None for each image."""
        return itertools.repeat(None, len(self._clean))

    def aligned(self, depth: np.ndarray) -> np.ndarray:
        """The image itself."""
        return depth
