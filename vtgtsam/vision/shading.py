# SPDX-License-Identifier: MIT
r"""How bright an object is on each of its sides, learnt from the images themselves.

Under light that comes from far away, from any directions, a matt surface of one colour is about as bright as

    I(n) = l_0 + l . n

with n its normal in the camera frame: the first four spherical harmonics (Basri and Jacobs, "Lambertian Reflectance
and Linear Subspaces", PAMI 2003). It holds however the object turns while camera and lamps stay, and what it leaves
over says how well: prints and shadows make ``sigma`` large, and differ from it by whole patches of pixels, ``alike``.
"""

from __future__ import annotations

import numpy as np

from . import noise_kernels
from .neighbours import LAGS, beside

KEPT = 0.9  # of what was learnt, from image to image
FLAT = (
    1e-3  # [gray levels^-2 of unit noise], how surely l is small, where the sides seen do not tell
)
FEWEST = 20  # pixels, with fewer an image says nothing
ROUNDS = 4  # of weighing
CUTOFF = 1.5  # [sigma], Huber's: a side that few pixels show must not be taken for an outlier
LEAST = 3.0  # [gray levels], of sigma: the light of dots is not gone entirely
AVERAGED = 10  # images over which sigma, and what is alike, are averaged
PLAIN = 6.0  # [gray levels], of sigma: while it is no more, patches are those of a pose that is a little off
WIDEST = 4.0  # [sigma], what is left above is something else
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
        self._products = np.zeros((2, LAGS + 1, 2))

    @property
    def sigma(self) -> float:
        """Standard deviation of a pixel's brightness from the expected one [gray levels]."""
        return max(self._sigma, LEAST)

    @property
    def alike(self) -> float:
        """How many neighbouring pixels in a line differ from it together; 1 if each does by itself."""
        patches = max(1.0 - (PLAIN / self.sigma) ** 2, 0.0)
        return 1.0 + 2.0 * patches * beside(self._products.sum(axis=0))

    def of(self, normals_c: np.ndarray) -> np.ndarray:
        """Expected brightness [gray levels] of surfaces with these normals, shapes (..., 3) to (...)."""
        brightness: np.ndarray = self._light[0] + normals_c @ self._light[1:]
        return brightness

    def learn(self, image: np.ndarray, normals_c: np.ndarray) -> None:
        """Take in an image.

        Args:
            image: Brightness [gray levels] of pixels that show the object, NaN elsewhere, shape (height, width).
            normals_c: The object's unit normals there, camera frame, shape (height, width, 3).
        """
        shows = ~np.isnan(image)
        brightness = image[shows]
        if len(brightness) < FEWEST:
            return
        rows = np.column_stack([np.ones(len(brightness)), normals_c[shows]])
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
        self._learn_alike(image - self.of(normals_c), len(brightness))

    def _learn_alike(self, left: np.ndarray, pixels: int) -> None:
        """Compare what is left with what is left some pixels away."""
        sums = np.zeros_like(self._products)
        left[~(np.abs(left) < WIDEST * self.sigma)] = np.nan
        noise_kernels.products(left, LAGS, sums)
        sums *= pixels / max(float(sums[0, 0, 1]), 1e-12)
        self._products += (sums - self._products) / min(self.images, AVERAGED)
