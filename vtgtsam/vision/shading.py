# SPDX-License-Identifier: MIT
r"""How bright an object is on each of its sides, learnt from the images themselves.

Under light that comes from far away, from any directions, a matt surface of one colour is about as bright as

    I(n) = l_0 + l . n

with n its normal in the camera frame: the first four spherical harmonics (Basri and Jacobs, "Lambertian Reflectance
and Linear Subspaces", PAMI 2003). It holds however the object turns while camera and lamps stay, and what it leaves
over, ``sigma``, says how well: prints and shadows make it large.
"""

from __future__ import annotations

import numpy as np

KEPT = 0.9  # of what was learnt, from image to image
FLAT = (
    1e-3  # [gray levels^-2 of unit noise], how surely l is small, where the sides seen do not tell
)
FEWEST = 20  # pixels, with fewer an image says nothing
ROUNDS = 4  # of weighing
CUTOFF = 1.5  # [sigma], Huber's: a side that few pixels show must not be taken for an outlier
LEAST = 3.0  # [gray levels], of sigma: the light of dots is not gone entirely
AVERAGED = 10  # images over which sigma is averaged
TO_SIGMA = 1.4826  # from a median of absolute values to a standard deviation


class Shading:
    """The brightness of one object.

    Attributes:
        images: Number of images learnt from.
    """

    def __init__(self) -> None:
        self.images = 0
        self._light = np.zeros(4)
        self._information, self._sum = np.zeros((4, 4)), np.zeros(4)
        self._sigma = 0.0

    @property
    def sigma(self) -> float:
        """Standard deviation of a pixel's brightness from the expected one [gray levels]."""
        return max(self._sigma, LEAST)

    def of(self, normals_c: np.ndarray) -> np.ndarray:
        """Expected brightness [gray levels] of surfaces with these normals, shapes (..., 3) to (...)."""
        brightness: np.ndarray = self._light[0] + normals_c @ self._light[1:]
        return brightness

    def learn(self, brightness: np.ndarray, normals_c: np.ndarray) -> None:
        """Take in pixels that show the object.

        Args:
            brightness: What they show [gray levels], shape (N,).
            normals_c: The object's unit normals there, camera frame, shape (N, 3).
        """
        if len(brightness) < FEWEST:
            return
        rows = np.column_stack([np.ones(len(brightness)), normals_c])
        weight = np.full(len(brightness), 1.0 / len(brightness))
        flat = FLAT * np.diag([0.0, 1.0, 1.0, 1.0])
        for _ in range(ROUNDS):
            information = KEPT * self._information + (rows.T * weight) @ rows
            total = KEPT * self._sum + rows.T @ (weight * brightness)
            light = np.linalg.solve(information + flat, total)
            left = brightness - rows @ light
            sigma = max(TO_SIGMA * float(np.median(np.abs(left))), 1.0)
            weight = 1.0 / np.maximum(np.abs(left) / (CUTOFF * sigma), 1.0) / len(brightness)
        self._information, self._sum, self._light = information, total, light
        self.images += 1
        self._sigma += (sigma - self._sigma) / min(self.images, AVERAGED)
