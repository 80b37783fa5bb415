# SPDX-License-Identifier: MIT
"""Where along a line across it an outline is: its posterior, given how bright the object should be."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled

HALF = 0.5  # [pixels], from one place tried to the next, and half of a pixel
CAP = 9.0  # [sigma^2], no pixel speaks more against a place
ANOTHER = 20.0  # [sigma^2], what it costs that there is another edge outside


@compiled
def places(
    lines: NDArray[np.float64],
    weights: NDArray[np.float64],
    expected: NDArray[np.float64],
    thickness: NDArray[np.int64],
    sigma: float,
    alike: float,
    search: int,
    found: NDArray[np.float64],
) -> None:
    r"""Find the mean and variance of where each line leaves the object.

    With the outline at d, pixel s of a line (outward) is the object's by the share a = clip(d - s + 1/2, 0, 1), and

        x_s = a E(d - s) + (1 - a) b + noise

    with E the expected brightness, counted inward, and b what lies beside the object, of which nothing is known but
    that it is even, or of two even parts (``ANOTHER``). Its cost, a sum of squares, gives p(d) ~ exp(-cost / 2 alike)
    for all d within ``search``, each as likely before. Where there is no contrast p stays flat, and its variance large.
    What is farther inward than the object is thick counts as noise would, whatever it is.

    Args:
        lines: Brightness at offsets -reach to reach, (N, 2 reach + 1).
        weights: Share of it that was seen, same shape.
        expected: Brightness of the object inward from its outline, (N, depth).
        thickness: How far that goes [pixels], (N,).
        sigma: Standard deviation of the noise.
        alike: How many neighbouring pixels of a line err together, 1 for independent noise; the cost is divided by it.
        search: Farthest place from the expected one [pixels].
        found: Filled with mean and variance of d, (N, 2) [pixels, pixels^2].
    """
    count, n = lines.shape
    tried, depth = 4 * search + 1, expected.shape[1]
    reach = (n - 1) // 2
    cost = np.empty(tried)
    sums = np.zeros((3, n + 1))  # of the weights, of the weighted brightness, of its squares
    for k in range(count):
        for i in range(n):
            w, x = weights[k, i], lines[k, i]
            sums[0, i + 1] = sums[0, i] + w
            sums[1, i + 1] = sums[1, i] + w * x
            sums[2, i + 1] = sums[2, i] + w * x * x
        least = np.inf
        for h in range(tried):
            d = HALF * h - search
            first = min(int(np.ceil(d + HALF)) + reach, n)
            total, beside = background(sums, first, sigma)
            for i in range(first):
                w = weights[k, i]
                if w == 0.0:
                    continue
                inward = max(d - (i - reach), 0.0)
                j = int(inward)
                if j + 1 >= thickness[k] or j + 1 >= depth:
                    total += w
                    continue
                y, share = inward - j, min(d - (i - reach) + HALF, 1.0)
                object_ = (1.0 - y) * expected[k, j] + y * expected[k, j + 1]
                other = object_ if np.isnan(beside) else beside
                rest = (lines[k, i] - share * object_ - (1.0 - share) * other) / sigma
                total += w * min(rest * rest, CAP)
            cost[h] = total
            least = min(least, total)
        whole, mean, square = 0.0, 0.0, 0.0
        for h in range(tried):
            d, p = HALF * h - search, np.exp(-0.5 * (cost[h] - least) / alike)
            whole += p
            mean += p * d
            square += p * d * d
        found[k, 0] = mean / whole
        found[k, 1] = square / whole - (mean / whole) ** 2


@compiled
def background(sums: NDArray[np.float64], first: int, sigma: float) -> tuple[float, float]:
    """Cost of a line's pixels from ``first`` on as one even part or two, and the brightness of the first part.

    Args:
        sums: Of weights, weighted brightness and its squares up to each pixel, (3, n + 1).
        first: The first pixel outside.
        sigma: Standard deviation of the noise.

    Returns:
        The cost [sigma^2], and the brightness; NaN where no pixel is seen.
    """
    n = sums.shape[1] - 1
    weight = sums[0, n] - sums[0, first]
    if weight <= 0.0:
        return 0.0, np.nan
    total = sums[1, n] - sums[1, first]
    squares = sums[2, n] - sums[2, first]
    best, mean = (squares - total * total / weight) / sigma**2, total / weight
    for split in range(first + 1, n):  # the pixel in which one part becomes the other is neither
        near, far = sums[0, split] - sums[0, first], sums[0, n] - sums[0, split + 1]
        if near <= HALF or far <= HALF:
            continue
        total_near, total_far = sums[1, split] - sums[1, first], sums[1, n] - sums[1, split + 1]
        left = squares - (sums[2, split + 1] - sums[2, split])
        left -= total_near**2 / near + total_far**2 / far
        if left / sigma**2 + ANOTHER < best:
            best, mean = left / sigma**2 + ANOTHER, total_near / near
    return best, mean
