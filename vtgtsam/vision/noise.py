# SPDX-License-Identifier: MIT
"""How noisy a depth camera is, learnt from the images themselves.

What is left between a followed object and the images that it was followed in, says how large the noise is, how
much more it is beside an edge, and how many neighbouring pixels err together. So a camera whose pixels err
independently is taken as such, one that matches patches is not trusted pixel by pixel, and nobody has to say
which it is.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from ..camera import CameraIntrinsics
from . import kernels, noise_kernels
from .alignment import Evidence
from .neighbours import CHANCE, LAGS, beside
from .view import MIN_SIGMA, View

NEAR = 6  # [pixels], so near to an edge noise may be larger
# Zones: 1 to NEAR steps from what covers the object, 1 to NEAR steps from its own outline, and the rest.
FAR, ZONES = 2 * NEAR, 2 * NEAR + 1
# What covers the object lends it a depth that is too small, what lies behind it one that is too large.
_SIGNS = np.repeat([-1.0, 1.0, 0.0], [NEAR, NEAR, 1])
JUMP, STEEP = (
    0.005,
    2.0,
)  # [m], [m/m]: depths that differ by more than a slope accounts for form an edge
MEMORY, LONG_MEMORY = 15, 100  # images over which noise, and its correlation, are averaged
WIDEST = 0.015  # [m], a difference above is another surface ...
WIDEST_SIGMAS = 4.0  # ... or above so many sigmas of what independent noise would be
DOUBT, DOUBTED = 0.01, 3.0  # [m], noise beside an edge before it was seen, as if in so many images
APART = (1, 10)  # images, after which it is asked how much of the noise has stayed
FEWEST = 30  # pixels of a kind, with fewer in an image it says nothing about them
TO_SIGMA = 1.4826  # from a median of absolute values to a standard deviation


class DepthNoise:
    """The noise of one camera, learnt image by image.

    Attributes:
        images: Number of images learnt from.
    """

    def __init__(self) -> None:
        self.images = 0
        self._variance = np.append(np.full(ZONES - 1, DOUBT**2), np.nan)
        self._seen = np.append(np.full(ZONES - 1, DOUBTED), 0.0)  # images that said something of it
        self._products = np.zeros((2, LAGS + 1, 2))
        self._earlier: list[tuple[CameraIntrinsics, np.ndarray]] = []
        self._kept = np.zeros((len(APART), 2))

    def on(self, view: View, evidence: Evidence) -> View:
        """The view with its noise, for poses about that of the evidence."""
        if self.images == 0:
            return view
        zone = zones(view, evidence)
        return replace(
            view,
            sigma=max(self.sigma, view.sigma),
            excess=self._excess()[zone],
            correlation=self.correlation,
        )

    @property
    def sigma(self) -> float:
        """Standard deviation far from edges [m]; the least there is where all is near one."""
        return max(float(np.sqrt(np.nanmin(self._variance))), MIN_SIGMA)

    @property
    def correlation(self) -> tuple[float, float]:
        """How many neighbours in a row, and in a column, err together; 1 for independent noise."""
        chance = CHANCE / min(max(self.images, 1), LONG_MEMORY)
        row, column = (1.0 + 2.0 * beside(products, chance) for products in self._products)
        return row, column

    @property
    def lingering(self) -> float:
        """Share of the noise that is the same in the next image, in [0, 1]."""
        return max(self._share_kept(0), self.persistence)

    @property
    def persistence(self) -> float:
        """Share of the noise that is the same 10 images later, in [0, 1]; before that was seen, one image later."""
        return self._share_kept(1 if self._kept[1, 1] > 0.0 else 0)

    def _share_kept(self, n: int) -> float:
        """Measured, or all of it where that could not be seen yet."""
        kept, whole = self._kept[n]
        return float(np.clip(kept / whole, 0.0, 1.0)) if whole > 0.0 else 1.0

    def learn(self, view: View, evidence: Evidence) -> None:
        """Take in what is left between a view, as it was measured, and the pose that was found in it."""
        difference = view.depth - evidence.predicted
        widest = max(WIDEST, WIDEST_SIGMAS * view.sigma)
        zone = zones(view, evidence)
        reach = np.where(zone == FAR, widest, 2.0 * widest)
        seen = (view.depth > 0.0) & ~view.hand & (np.abs(difference) < reach)
        if self.images and not view.hand_is_known:
            seen &= (
                evidence.kind != kernels.COVERED
            )  # a finger on the object is no noise of its surface
        self.images += 1
        self._learn_variance(difference[seen], zone[seen])
        left = self._left(difference, zone, seen)
        if np.count_nonzero(~np.isnan(left)) >= FEWEST:
            if self.images > 1:  # the first image comes twice: before it is aligned, and after
                self._learn_persistence(left, view.camera)
            self._learn_correlation(left)

    def _left(self, difference: np.ndarray, zone: np.ndarray, seen: np.ndarray) -> np.ndarray:
        """What is left far from edges [m], NaN elsewhere; of what is too thin for that, everywhere, as if far."""
        limit = WIDEST_SIGMAS * self.sigma
        far = seen & (zone == FAR) & (np.abs(difference) < limit)
        if np.count_nonzero(far) >= FEWEST:
            return np.where(far, difference, np.nan)
        as_if_far = self.sigma / np.sqrt(np.fmax(self._variance, self.sigma**2))
        left = difference * as_if_far[zone]
        return np.where(seen & (np.abs(left) < limit), left, np.nan)

    def _learn_variance(self, rest: np.ndarray, zone: np.ndarray) -> None:
        for z in range(ZONES):
            here = np.abs(rest[zone == z])
            if len(here) < FEWEST:
                continue
            now = max((TO_SIGMA * float(np.median(here))) ** 2, MIN_SIGMA**2)
            self._seen[z] += 1
            share, before = 1.0 / min(self._seen[z], MEMORY), self._variance[z]
            # A mean of logarithms: a doubt too large by far is given up as fast as one too small.
            self._variance[z] = now if np.isnan(before) else before * (now / before) ** share

    def _learn_persistence(self, residual: np.ndarray, camera: CameraIntrinsics) -> None:
        """Compare with what was left in images some time ago, pixel by pixel; what all have in common is the pose's."""
        self._earlier.append((camera, residual))
        for n, apart in enumerate(APART):
            if len(self._earlier) <= apart:
                break
            before, earlier = self._earlier[-1 - apart]
            if before.fx != camera.fx:
                continue  # another part of the rows and columns was looked at
            right, down = round(before.cx - camera.cx), round(before.cy - camera.cy)
            now, then = _common(residual, earlier, right, down)
            both = ~(np.isnan(now) | np.isnan(then))
            if np.count_nonzero(both) < FEWEST:
                continue
            a, b = now[both] - now[both].mean(), then[both] - then[both].mean()
            sums = np.array([float(a @ b), 0.5 * float(a @ a + b @ b)]) / len(a)
            self._kept[n] += (sums - self._kept[n]) / MEMORY
        del self._earlier[: -max(APART)]

    def _learn_correlation(self, residual: np.ndarray) -> None:
        """Compare pixels with their neighbours."""
        sums = np.zeros_like(self._products)
        noise_kernels.products(residual, LAGS, sums)
        sums *= np.count_nonzero(~np.isnan(residual)) / max(float(sums[0, 0, 1]), 1e-12)
        share = 1.0 / min(self.images, LONG_MEMORY)
        self._products = (1.0 - share) * self._products + share * sums

    def _excess(self) -> np.ndarray:
        """What an edge adds to the noise [m], by zone, with the sign that it mostly has, shape (ZONES,)."""
        added = np.nan_to_num(self._variance) - self.sigma**2
        excess: np.ndarray = _SIGNS * np.sqrt(np.maximum(added, 0.0))
        return excess


def zones(view: View, evidence: Evidence) -> np.ndarray:
    """Which zone each pixel is in: near what covers the object there, near what lies behind it, or neither."""
    front = np.minimum(evidence.predicted, view.hand_depth)
    covered = (evidence.kind == kernels.COVERED) & ~view.hand & (not view.hand_is_known)
    front[covered] = np.minimum(front, view.depth)[covered]
    zone = np.full(view.depth.shape, FAR)
    noise_kernels.zones(front, evidence.predicted, JUMP, STEEP / view.camera.fx, NEAR, zone)
    return zone


def _common(
    now: np.ndarray, then: np.ndarray, right: int, down: int
) -> tuple[np.ndarray, np.ndarray]:
    """The parts of two images that show the same pixels, where the first one begins so much farther on."""
    now, then = now[max(-down, 0) :, max(-right, 0) :], then[max(down, 0) :, max(right, 0) :]
    height, width = min(len(now), len(then)), min(now.shape[1], then.shape[1])
    return now[:height, :width], then[:height, :width]
