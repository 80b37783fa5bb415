# SPDX-License-Identifier: MIT
"""The dots that the projector throws on the scene, the same in every image.

They are fixed in the projector, so what they do to the matching is fixed in the image: errors that do not
average out over frames.
"""

from __future__ import annotations

from functools import lru_cache

import cv2
import gtsam
import numpy as np

from . import kernels

DOTS = 5000  # Intel, "Projectors for D400 Series Depth Cameras"
FIELD = np.deg2rad([90.0, 63.0])  # [rad], width and height of the pattern (same)
DOT_SIGMA = 0.0019  # [m at 1 m], a dot's Gaussian: 0.8 pixels of the imagers
RESOLUTION = 800.0  # [pixels of the pattern's image at 1 m]
_SEED = 435  # one projector, whatever is simulated


@lru_cache(maxsize=1)
def pattern() -> np.ndarray:
    """Brightness of the pattern on a plane 1 m away, 1 in the middle of a lone dot, (height, width), float32.

    The middle of the image is the projector's axis; a pixel is 1 / ``RESOLUTION`` m.
    """
    width, height = 2.0 * np.tan(FIELD / 2.0)  # [m at 1 m]
    columns = round(np.sqrt(DOTS * width / height))
    rows = round(DOTS / columns)
    rng = np.random.default_rng(_SEED)
    cells = np.stack(np.meshgrid(np.arange(columns), np.arange(rows)), axis=-1).reshape(-1, 2)
    places = (cells + rng.uniform(0.0, 1.0, cells.shape)) / (columns, rows)
    size = np.rint(np.array([width, height]) * RESOLUTION).astype(int)
    u, v = np.minimum((places * size).astype(int), size - 1).T
    image = np.zeros((size[1], size[0]), dtype=np.float32)
    np.add.at(image, (v, u), 1.0)
    sigma = DOT_SIGMA * RESOLUTION
    spread: np.ndarray = cv2.GaussianBlur(image, (0, 0), sigma)
    return spread * np.float32(2.0 * np.pi * sigma**2)


def dots_at(points_w: np.ndarray, T_wp: gtsam.Pose3) -> np.ndarray:
    """Brightness of the pattern at points, shape (N, 3) [m], as if they were 1 m from the projector; (N,)."""
    bright = np.empty(len(points_w))
    origin, R = np.asarray(T_wp.translation()), T_wp.rotation().matrix()
    kernels.look_up(points_w, origin, R, pattern(), RESOLUTION, bright)
    return bright
