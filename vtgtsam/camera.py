# SPDX-License-Identifier: MIT
"""The pinhole camera: rays of pixels, points of depth images.

The camera frame c has x to the right, y down and z forward. Pixel (u, v) has its centre at the whole
numbers u (column) and v (row), as in OpenCV and ROS. A depth image holds z [m], not the length of the
ray, and 0 (or NaN) where nothing was measured.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class CameraIntrinsics:
    """Size, focal lengths and principal point of a camera without distortion [pixels]."""

    width: int
    height: int
    fx: float
    fy: float
    cx: float
    cy: float

    def __post_init__(self) -> None:
        if self.width < 1 or self.height < 1:
            raise ValueError(f"an image needs pixels, got {self.width} x {self.height}")
        if not (np.isfinite([self.fx, self.fy, self.cx, self.cy]).all() and self.fx > 0 < self.fy):
            raise ValueError(f"focal lengths must be positive and all numbers finite, got {self}")

    @property
    def matrix(self) -> np.ndarray:
        """The camera matrix K, shape (3, 3)."""
        return np.array([[self.fx, 0.0, self.cx], [0.0, self.fy, self.cy], [0.0, 0.0, 1.0]])

    def scaled(self, factor: float) -> CameraIntrinsics:
        """The same view with ``factor`` times as many pixels a side; 0.5 halves the resolution."""
        return CameraIntrinsics(
            width=round(self.width * factor),
            height=round(self.height * factor),
            fx=self.fx * factor,
            fy=self.fy * factor,
            cx=(self.cx + 0.5) * factor
            - 0.5,  # the image's corner, not a pixel's centre, stays put
            cy=(self.cy + 0.5) * factor - 0.5,
        )

    def cropped(self, left: int, top: int, width: int, height: int) -> CameraIntrinsics:
        """The window of ``width`` x ``height`` pixels whose first pixel is (left, top)."""
        return CameraIntrinsics(width, height, self.fx, self.fy, self.cx - left, self.cy - top)

    def strided(self, step: int) -> CameraIntrinsics:
        """The camera of ``image[::step, ::step]``."""
        return CameraIntrinsics(
            width=-(-self.width // step),
            height=-(-self.height // step),
            fx=self.fx / step,
            fy=self.fy / step,
            cx=self.cx / step,
            cy=self.cy / step,
        )

    def rays(self) -> np.ndarray:
        """Points of all pixels at depth 1 m, shape (height, width, 3), camera frame."""
        u, v = np.meshgrid(np.arange(self.width), np.arange(self.height))
        x, y = (u - self.cx) / self.fx, (v - self.cy) / self.fy
        return np.stack([x, y, np.ones_like(x)], axis=-1)

    def project(self, points_c: np.ndarray) -> np.ndarray:
        """Pixels (u, v) of points [m] in front of the camera, shapes (N, 3) to (N, 2), camera frame."""
        x, y, z = np.asarray(points_c, dtype=np.float64).T
        return np.column_stack([self.fx * x / z + self.cx, self.fy * y / z + self.cy])

    def check(self, depth: np.ndarray) -> np.ndarray:
        """A depth image [m] as float64 of this camera's size, with 0 where nothing was measured.

        Raises:
            ValueError: The image has another size or looks like millimetres.
        """
        image = np.array(depth, dtype=np.float64, order="C")
        if image.shape != (self.height, self.width):
            raise ValueError(
                f"the depth image must have shape {(self.height, self.width)}, got {image.shape}"
            )
        image[~(np.isfinite(image) & (image > 0.0))] = 0.0
        if image.max() > 65.0:  # no depth camera of a robot hand sees that far
            raise ValueError(
                f"depths must be in metres, got up to {image.max():g}; "
                "divide a 16 bit image of millimetres by 1000"
            )
        return image

    def back_project(self, depth: np.ndarray) -> np.ndarray:
        """Measured points of a depth image [m], shape (N, 3), camera frame, row by row."""
        image = self.check(depth)
        measured = image > 0.0
        points_c: np.ndarray = self.rays()[measured] * image[measured, None]
        return points_c
