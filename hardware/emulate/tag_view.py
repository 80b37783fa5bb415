# SPDX-License-Identifier: MIT
"""What a camera sees of an AprilTag: tag 0 of family tag36h11 in front of grey."""

from __future__ import annotations

import time
from dataclasses import replace

import gtsam
import numpy as np
from scipy.ndimage import gaussian_filter

from hardware.camera.camera import Camera, CameraFrame
from hardware.camera.wrist import TagMount
from vtgtsam import HandModel
from vtgtsam.camera import CameraIntrinsics
from vtgtsam.vision.hand_mask import HandMask

TAG_ID = 0
# As printed upright, with its white rim; # is black. The tag's size is that of the black square.
_TAG = """
..........
.########.
.#..#.#.#.
.##...#.#.
.##..####.
.#.#.####.
.##.#..##.
.####.###.
.########.
..........
"""
_CELLS = np.array([[cell == "#" for cell in row] for row in _TAG.split()])
_BLACK, _WHITE, _BACKGROUND = 30.0, 220.0, 110.0  # grey levels
_WALL = 1.2  # [m], from the camera
_DEPTH_NOISE = 0.002  # [m]
_SAMPLES = 6  # a side within a pixel


def render_tag(
    T_ct: gtsam.Pose3, intrinsics: CameraIntrinsics, size: float, blur: float = 0.6
) -> np.ndarray:
    """A grey image without noise, shape (H, W), float64.

    Args:
        T_ct: Pose of the tag (frame as in ``hardware.camera.tag``) in the camera frame.
        intrinsics: Of the camera.
        size: Side of the black square [m].
        blur: Standard deviation of the lens's blur [pixels].
    """
    image = np.full((intrinsics.height, intrinsics.width), _BACKGROUND)
    rows, columns = _window(T_ct, intrinsics, size)
    steps = (np.arange(_SAMPLES) + 0.5) / _SAMPLES - 0.5
    v = (np.arange(rows.start, rows.stop)[:, None] + steps).ravel()
    u = (np.arange(columns.start, columns.stop)[:, None] + steps).ravel()
    fine = _grey_at(*np.meshgrid(u, v), T_ct, intrinsics, size)
    blocks = fine.reshape(rows.stop - rows.start, _SAMPLES, columns.stop - columns.start, _SAMPLES)
    image[rows, columns] = blocks.mean(axis=(1, 3))
    return np.asarray(gaussian_filter(image, blur))


def _window(T_ct: gtsam.Pose3, intrinsics: CameraIntrinsics, size: float) -> tuple[slice, slice]:
    """Rows and columns of the image that the tag with its rim may touch."""
    half = 0.5 * size * len(_CELLS) / (len(_CELLS) - 2)
    corners_t = np.array([[x, y, 0.0] for x in (-half, half) for y in (-half, half)])
    corners_c = corners_t @ T_ct.rotation().matrix().T + T_ct.translation()
    if corners_c[:, 2].min() <= 0:
        raise ValueError("the tag must lie in front of the camera")
    pixels = intrinsics.project(corners_c)
    first = np.maximum(np.floor(pixels.min(axis=0)).astype(int) - 1, 0)
    last = np.ceil(pixels.max(axis=0)).astype(int) + 2
    columns, rows = (
        slice(int(a), int(max(a, min(b, end))))
        for a, b, end in zip(first, last, (intrinsics.width, intrinsics.height), strict=True)
    )
    return rows, columns


def _grey_at(
    u: np.ndarray, v: np.ndarray, T_ct: gtsam.Pose3, intrinsics: CameraIntrinsics, size: float
) -> np.ndarray:
    """Grey level that the ray of each point of the image meets, in the shape of u and v."""
    rays_c = np.stack(
        [
            (u - intrinsics.cx) / intrinsics.fx,
            (v - intrinsics.cy) / intrinsics.fy,
            np.ones_like(u),
        ],
        axis=-1,
    )
    R_ct, origin_c = T_ct.rotation().matrix(), T_ct.translation()
    depth = (R_ct[:, 2] @ origin_c) / (rays_c @ R_ct[:, 2])
    points_t = (rays_c * depth[..., None] - origin_c) @ R_ct
    count = len(_CELLS)
    cells = np.floor(points_t[..., :2] * (count - 2) / size + count / 2).astype(int)
    on_tag = ((cells >= 0) & (cells < count)).all(axis=-1)
    column, row = np.clip(cells, 0, count - 1)[..., 0], np.clip(cells, 0, count - 1)[..., 1]
    return np.where(on_tag, np.where(_CELLS[row, column], _BLACK, _WHITE), _BACKGROUND)


class TagCamera(Camera):
    """A camera that sees the tag at rest, with sensor noise and without depth."""

    def __init__(
        self,
        T_ct: gtsam.Pose3,
        size: float,
        intrinsics: CameraIntrinsics,
        noise: float = 1.6,
        seed: int = 0,
    ) -> None:
        """Place the tag.

        Args:
            T_ct: Pose of the tag in the camera frame.
            size: Side of its black square [m].
            intrinsics: Of the camera.
            noise: Standard deviation of a pixel [grey levels].
            seed: Of the noise.
        """
        self.name = "emulated camera"
        self.intrinsics = intrinsics
        self._clean = render_tag(T_ct, intrinsics, size)
        self._noise = noise
        self._rng = np.random.default_rng(seed)

    def read(self) -> CameraFrame:
        """The next images, at once."""
        noisy = self._clean + self._noise * self._rng.standard_normal(self._clean.shape)
        grey = np.clip(np.rint(noisy), 0, 255).astype(np.uint8)
        depth = np.zeros(grey.shape, dtype=np.float32)
        return CameraFrame(time.monotonic(), depth, np.repeat(grey[..., None], 3, axis=2))

    def close(self) -> None:
        """Nothing is held."""


class HandCamera(TagCamera):
    """A camera that sees the tag and, in depth, the hand that carries it, in front of a wall.

    Args:
        hand: The hand.
        joints: Its joint angles in the model's order [rad].
        T_ch: Where it truly is.
        mount: The tag on it.
        intrinsics: Of the camera.
        printed: Side of the black square as it was printed [m]; as in ``mount`` where None.
    """

    def __init__(
        self,
        hand: HandModel,
        joints: np.ndarray,
        T_ch: gtsam.Pose3,
        mount: TagMount,
        intrinsics: CameraIntrinsics,
        printed: float | None = None,
    ) -> None:
        super().__init__(T_ch.compose(mount.pose), printed or mount.size, intrinsics)
        seen = HandMask(hand).depth(intrinsics, T_ch.inverse(), joints)
        self._depth = np.where(np.isfinite(seen), seen, _WALL)

    def read(self) -> CameraFrame:
        """The next images, at once."""
        frame = super().read()
        depth = self._depth + _DEPTH_NOISE * self._rng.standard_normal(self._depth.shape)
        return replace(frame, depth=depth.astype(np.float32))
