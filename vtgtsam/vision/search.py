# SPDX-License-Identifier: MIT
"""Find the object again where the images no longer support the pose it was thought to have.

Many poses around the last good one are judged on a coarse image, the best of them aligned. The longer the
object is lost, the wider they spread, and the best of one image are tried again on the next.
"""

from __future__ import annotations

import gtsam
import numpy as np

from .alignment import Evidence, Shape, align, outline_pixels, stride
from .view import View

TRIES = 30  # poses judged in one image
KEPT = 3  # of those, how many are aligned
COARSE_PIXELS, FINE_PIXELS = 100, 400  # of the object's outline, for judging and for aligning
AGAINST = 3.0  # how many pixels of surface one pixel against a pose outweighs
FIRST = np.array([0.1, 0.006])  # [rad, m], spread in the first image without the object ...
GROWTH = np.array([0.02, 0.0015])  # ... what each further one adds ...
LAST = np.array([1.0, 0.05])  # ... and where it ends


class Search:
    """Looks for one object, image after image, until it is found.

    Attributes:
        images: Number of images looked at in vain.
    """

    def __init__(self, shape: Shape) -> None:
        self._shape = shape
        self.forget()

    def forget(self) -> None:
        """Begin anew: the object is not lost, or was found."""
        self.images = 0
        self._best: list[gtsam.Pose3] = []
        self._rng = np.random.default_rng(0)  # the same images always give the same poses

    @property
    def spread(self) -> np.ndarray:
        """Standard deviation of the poses tried, rotation [rad] and translation [m], shape (2,)."""
        wide: np.ndarray = np.minimum(FIRST + self.images * GROWTH, LAST)
        return wide

    def look(self, view: View, T_co: gtsam.Pose3, T_wc: gtsam.Pose3) -> gtsam.Pose3:
        """The best pose found in an image, object in camera; whether it is good is for others to say.

        Args:
            view: The image.
            T_co: The last good pose, where the camera is now.
            T_wc: Where the camera is now.
        """
        tries = [T_co, *(T_wc.inverse() * T_wo for T_wo in self._best), *self._around(T_co)]
        outline = outline_pixels(self._shape, view, T_co)
        coarse = view.strided(stride(outline, COARSE_PIXELS))
        fine = view.strided(stride(outline, FINE_PIXELS))
        first = sorted(tries, key=lambda T: -score(Evidence(self._shape, coarse, T)))[:KEPT]
        aligned = [align(self._shape, fine, T, iterations=4) for T in first]
        aligned.sort(key=lambda T: -score(Evidence(self._shape, fine, T)))
        self._best = [T_wc * T for T in aligned]
        self.images += 1
        return aligned[0]

    def _around(self, T_co: gtsam.Pose3) -> list[gtsam.Pose3]:
        center = gtsam.Pose3(gtsam.Rot3(), self._shape.center_o)
        steps = self._rng.standard_normal((TRIES, 6)) * np.repeat(self.spread, 3)
        return [T_co * center * gtsam.Pose3.Expmap(xi) * center.inverse() for xi in steps]


def score(seen: Evidence) -> float:
    """How much an image speaks for a pose: surface seen, less what is seen through it, per outline."""
    return (seen.surface - AGAINST * seen.through) / max(seen.outline, 1)
