# SPDX-License-Identifier: MIT
"""The simulated colour camera: MuJoCo's renderer, and the paper's noise.

Unlike depth images, which are ray cast, these depend on the graphics driver in their last bits.
"""

from __future__ import annotations

from collections.abc import Iterator

import gtsam
import mujoco
import numpy as np

from vtgtsam.camera import CameraIntrinsics

from .graphics import Canvas
from .observe import Noise, camera_pose
from .replay import Replay
from .simulate import Trajectory
from .world import World

SIGMA = np.sqrt(2.6)  # [gray levels of 255] (paper, "Simulation Experiment Setup")
NEAR, FAR = 0.05, 5.0  # [m], what is nearer or farther is not drawn


class ColorCamera:
    """Colour images of a scene from a pinhole camera; use it in a ``with`` statement.

    Args:
        model: The compiled scene.
        intrinsics: Of the images; pixels must be square.

    Raises:
        NoGraphics: There is nothing to draw with.
    """

    def __init__(self, model: mujoco.MjModel, intrinsics: CameraIntrinsics) -> None:
        if not np.isclose(intrinsics.fx, intrinsics.fy):
            raise ValueError(f"pixels must be square, got {intrinsics}")
        self._model, self._intrinsics = model, intrinsics
        self._canvas = Canvas(model, intrinsics.width, intrinsics.height)
        self._options = mujoco.MjvOption()
        self._options.sitegroup[:] = 0

    def __enter__(self) -> ColorCamera:
        return self

    def __exit__(self, *exc_info: object) -> None:
        self._canvas.close()

    def render(self, data: mujoco.MjData, T_wc: gtsam.Pose3) -> np.ndarray:
        """The image at the poses ``data`` holds (after ``mj_kinematics``), RGB, uint8, (height, width, 3)."""
        scene = self._canvas.scene
        mujoco.mj_camlight(self._model, data)
        mujoco.mjv_updateScene(
            self._model,
            data,
            self._options,
            mujoco.MjvPerturb(),
            mujoco.MjvCamera(),  # replaced below
            mujoco.mjtCatBit.mjCAT_ALL,
            scene,
        )
        for eye in scene.camera:  # for the left and the right eye
            self._place(eye, T_wc)
        return self._canvas.draw()

    def _place(self, eye: mujoco.MjvGLCamera, T_wc: gtsam.Pose3) -> None:
        """Let a camera of OpenGL see what the pinhole camera sees.

        The borders of the image lie half a pixel outside the centres of the outer pixels.
        """
        i, R = self._intrinsics, T_wc.rotation().matrix()
        eye.pos[:], eye.forward[:], eye.up[:] = T_wc.translation(), R[:, 2], -R[:, 1]
        left, right = (-0.5 - i.cx) / i.fx, (i.width - 0.5 - i.cx) / i.fx
        eye.frustum_center = NEAR * (left + right) / 2
        eye.frustum_top = NEAR * (i.cy + 0.5) / i.fy
        eye.frustum_bottom = NEAR * (i.cy + 0.5 - i.height) / i.fy
        eye.frustum_near, eye.frustum_far = NEAR, FAR


class ColorVideo:
    """The colour images of one trajectory, drawn once; noise is put on them as often as wanted."""

    def __init__(
        self,
        world: World,
        trajectory: Trajectory,
        camera: CameraIntrinsics,
        T_wc: gtsam.Pose3 | None = None,
    ) -> None:
        T_wc = camera_pose(world) if T_wc is None else T_wc
        replay = Replay(world.model, world.hand.joint_names)
        self._clean = []
        with ColorCamera(world.model, camera) as color_camera:
            for joints, T_wh, T_wo in zip(
                trajectory.frame_joints, trajectory.frame_T_wh, trajectory.frame_T_wo, strict=True
            ):
                replay.show(joints, T_wh, T_wo)
                self._clean.append(color_camera.render(replay.data, T_wc))

    def images(self, noise: Noise) -> Iterator[np.ndarray]:
        """The images as measured, RGB, uint8, shape (height, width, 3)."""
        # A seed of their own: depth images are the same with and without them.
        seed = np.random.SeedSequence(noise.seed.entropy, spawn_key=(*noise.seed.spawn_key, 0))
        rng = np.random.default_rng(seed)
        for clean in self._clean:
            yield add_color_noise(clean, rng, noise.scale)


def add_color_noise(image: np.ndarray, rng: np.random.Generator, scale: float) -> np.ndarray:
    """An image, uint8, with the paper's Gaussian noise times ``scale`` in each channel."""
    noisy = image + scale * SIGMA * rng.standard_normal(image.shape)
    return np.asarray(np.clip(np.rint(noisy), 0, 255), dtype=np.uint8)
