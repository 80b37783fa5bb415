# SPDX-License-Identifier: MIT
"""The part of a depth image that matters to one object."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from ..camera import CameraIntrinsics
from .infrared import Infrared

MIN_SIGMA = 0.5e-3  # [m], an image without noise still meets a distance field with cells


@dataclass(frozen=True, eq=False)
class View:
    """The part of a depth image around the object.

    Attributes:
        depth: Measured depth [m], shape (height, width), 0 where there is none.
        hand: Where the hand is known to be, same shape.
        camera: Its intrinsics.
        sigma: Standard deviation of the depth's noise [m], away from edges.
        hand_depth: Depth of the hand alone [m], inf where it is not or is not known, shape (height, width).
        excess: What edges add to it [m], shape (height, width): a pixel's variance is the sum of squares.
        correlation: How many neighbouring pixels of a row, and of a column, err together; 1 if none do.
        infrared: The infrared image of the same part, None without one.
    """

    depth: np.ndarray
    hand: np.ndarray
    camera: CameraIntrinsics
    sigma: float
    hand_depth: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    excess: np.ndarray = field(default_factory=lambda: np.zeros((0, 0)))
    correlation: tuple[float, float] = (1.0, 1.0)
    infrared: Infrared | None = None

    def __post_init__(self) -> None:
        if self.hand_depth.shape != self.depth.shape:
            object.__setattr__(self, "hand_depth", np.full(self.depth.shape, np.inf))
        if self.excess.shape != self.depth.shape:
            object.__setattr__(self, "excess", np.zeros(self.depth.shape))

    @property
    def hand_is_known(self) -> bool:
        """Whether the hand's own depth is at hand, so that what covers the object is known."""
        return bool(np.isfinite(self.hand_depth).any())

    def strided(self, step: int) -> View:
        """Every ``step``-th row and column of it."""
        if step == 1:
            return self
        row, column = self.correlation
        return View(
            np.ascontiguousarray(self.depth[::step, ::step]),
            np.ascontiguousarray(self.hand[::step, ::step]),
            self.camera.strided(step),
            self.sigma,
            np.ascontiguousarray(self.hand_depth[::step, ::step]),
            np.ascontiguousarray(self.excess[::step, ::step]),
            (max(row / step, 1.0), max(column / step, 1.0)),
            None if self.infrared is None else self.infrared.strided(step),
        )


def crop(
    depth: np.ndarray, camera: CameraIntrinsics, points_c: np.ndarray, margin: float
) -> View | None:
    """The part of an image around some points; None where they are outside of it or behind.

    Args:
        depth: The image [m], shape (height, width), 0 where nothing was measured.
        camera: Its intrinsics.
        points_c: The points [m], shape (N, 3), camera frame.
        margin: How far beyond the points the part reaches [m].
    """
    nearest, farthest = points_c[:, 2].min() - margin, points_c[:, 2].max() + margin
    if nearest <= 0.0:
        return None
    pixels, around = camera.project(points_c), margin / nearest
    first = pixels.min(axis=0) - around * np.array([camera.fx, camera.fy])
    last = pixels.max(axis=0) + around * np.array([camera.fx, camera.fy])
    left, top = np.clip(first, 0, (camera.width, camera.height)).astype(int).tolist()
    right, bottom = np.clip(last + 1.0, 0, (camera.width, camera.height)).astype(int).tolist()
    if left >= right or top >= bottom:
        return None
    part = np.ascontiguousarray(depth[top:bottom, left:right])
    near = np.where((part > nearest) & (part < farthest), part, 0.0)
    return View(
        depth=part,
        hand=np.zeros(part.shape, dtype=bool),
        camera=camera.cropped(left, top, right - left, bottom - top),
        sigma=max(noise_of(near), MIN_SIGMA),
    )


def noise_of(depth: np.ndarray) -> float:
    """Standard deviation of a depth image's noise [m], from the second differences along its rows.

    Surfaces are smooth over three pixels, noise is not: for independent noise a second difference has
    variance 6 sigma^2. The median does not mind edges. 0 where nothing was measured.
    """
    first, middle, last = depth[:, :-2], depth[:, 1:-1], depth[:, 2:]
    measured = (first > 0.0) & (middle > 0.0) & (last > 0.0)
    if not measured.any():
        return 0.0
    second = np.abs(first - 2.0 * middle + last)[measured]
    return float(1.4826 * np.median(second) / np.sqrt(6.0))
