# SPDX-License-Identifier: MIT
"""Where the object's outline is expected in an image, and what the image shows along lines across it.

Arguments are as in ``ray_kernels``. A view may have every ``step``-th row and column of the image alone: what counts
in pixels of the image is divided by ``step`` there.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from .ray_kernels import ray, trace

HALVINGS = 4  # of a pixel, to find the outline in it
BEFORE, BEHIND = 5.0, 10.0  # [cells], how far around the last point the next one may be
AROUND, SPREAD = 3, 1.5  # [pixels], the mask is smoothed with such a Gaussian to find its normal
HEADLONG = (
    0.7  # cosine, of the angle between the normal and the step that left the object, at least
)
IN_FRONT = 0.003  # [m], what is no nearer than so much behind the object may be in front of it
LEAST_SEEN = 0.3  # of the weight of four pixels; a mean of fewer is none


@compiled
def outline(
    values: NDArray[np.float32],
    lower: NDArray[np.float64],
    scale: NDArray[np.float64],
    camera: NDArray[np.float64],
    R_oc: NDArray[np.float64],
    t_oc: NDArray[np.float64],
    predicted: NDArray[np.float64],
    hand_depth: NDArray[np.float64],
    clear: int,
    points_o: NDArray[np.float64],
    pixels: NDArray[np.float64],
    normals: NDArray[np.float64],
    depths: NDArray[np.float64],
) -> int:
    """Find points of the outline that nothing covers, one for each step from a pixel inside to one outside.

    Args:
        values: See above.
        lower: See above.
        scale: See above.
        camera: See above.
        R_oc: See above.
        t_oc: See above.
        predicted: Depth of the object alone [m], inf beside it, shape (height, width).
        hand_depth: Depth of the hand alone [m], inf beside it, same shape.
        clear: So many pixels around a point the hand must not be in front of it.
        points_o: Filled with the points of the object [m], (N, 3).
        pixels: Filled with where they are in the view, (N, 2).
        normals: Filled with the outline's normals there, outward, unit length, (N, 2).
        depths: Filled with their depths [m], (N,).

    Returns:
        The number of points, at most N.
    """
    height, width = predicted.shape
    direction, normal, count = np.empty(3), np.empty(2), 0
    cell = 1.0 / scale[0]
    for v in range(1, height - 1):
        for u in range(1, width - 1):
            at = predicted[v, u]
            if at == np.inf:
                continue
            for side in range(4):
                du, dv = (1, 0, -1, 0)[side], (0, 1, 0, -1)[side]
                if predicted[v + dv, u + du] < np.inf or count == len(points_o):
                    continue
                if is_covered(hand_depth, u, v, clear, at):
                    continue
                outward(predicted, u + 0.5 * du, v + 0.5 * dv, normal)
                if normal[0] * du + normal[1] * dv < HEADLONG:
                    continue  # a step along the other axis crosses the outline there
                inside, outside, met = 0.0, 1.0, at
                for _ in range(HALVINGS):
                    middle = 0.5 * (inside + outside)
                    ray(camera, R_oc, u + middle * du, v + middle * dv, direction)
                    start, end = met - BEFORE * cell, met + BEHIND * cell
                    hit = trace(values, lower, scale, t_oc, direction, start, end)
                    if hit < np.inf:
                        inside, met = middle, hit
                    else:
                        outside = middle
                ray(camera, R_oc, u + inside * du, v + inside * dv, direction)
                for i in range(3):
                    points_o[count, i] = t_oc[i] + met * direction[i]
                middle = 0.5 * (inside + outside)
                pixels[count, 0], pixels[count, 1] = u + middle * du, v + middle * dv
                normals[count, 0], normals[count, 1] = normal[0], normal[1]
                depths[count] = met
                count += 1
    return count


@compiled
def is_covered(hand_depth: NDArray[np.float64], u: int, v: int, clear: int, depth: float) -> bool:
    """Whether the hand is in front of a depth [m] within so many pixels."""
    height, width = hand_depth.shape
    for b in range(max(v - clear, 0), min(v + clear + 1, height)):
        for a in range(max(u - clear, 0), min(u + clear + 1, width)):
            if hand_depth[b, a] < depth + IN_FRONT:
                return True
    return False


@compiled
def outward(
    predicted: NDArray[np.float64], u: float, v: float, normal: NDArray[np.float64]
) -> None:
    """Fill ``normal`` (2,) with the direction in which the smoothed mask falls off fastest, unit length."""
    height, width = predicted.shape
    x, y = 0.0, 0.0
    middle_u, middle_v = int(u), int(v)
    for b in range(max(middle_v - AROUND, 0), min(middle_v + AROUND + 2, height)):
        for a in range(max(middle_u - AROUND, 0), min(middle_u + AROUND + 2, width)):
            if predicted[b, a] < np.inf:
                weight = np.exp(-0.5 * ((b - v) ** 2 + (a - u) ** 2) / SPREAD**2)
                x -= weight * (a - u)
                y -= weight * (b - v)
    length = max(np.sqrt(x * x + y * y), 1e-12)
    normal[0], normal[1] = x / length, y / length


@compiled
def across(
    brightness: NDArray[np.float64],
    front: NDArray[np.float64],
    step: int,
    pixels: NDArray[np.float64],
    normals: NDArray[np.float64],
    depths: NDArray[np.float64],
    beside: int,
    lines: NDArray[np.float64],
    weights: NDArray[np.float64],
) -> None:
    """Read the brightness along lines across the outline, each the mean of some side by side.

    Args:
        brightness: The image, NaN where it shows nothing of the scene, shape (height, width).
        front: Depth of the hand in the view's pixels [m], inf where it is not.
        step: See above.
        pixels: Where the lines cross the outline, in the image, (N, 2).
        normals: Their directions, (N, 2).
        depths: Depth of the outline there [m], (N,).
        beside: So many pixels to each side are averaged.
        lines: Filled with the brightness at offsets -reach to reach, outward, (N, 2 reach + 1).
        weights: Filled with the share of the image's pixels seen there, same shape: 0 where the hand is in front.
    """
    height, width = front.shape
    reach = (lines.shape[1] - 1) // 2
    for k in range(len(pixels)):
        for i in range(lines.shape[1]):
            total, seen = 0.0, 0.0
            for t in range(-beside, beside + 1):
                u = pixels[k, 0] + (i - reach) * normals[k, 0] - t * normals[k, 1]
                v = pixels[k, 1] + (i - reach) * normals[k, 1] + t * normals[k, 0]
                a, b = int(np.rint(u / step)), int(np.rint(v / step))
                if not (0 <= a < width and 0 <= b < height) or front[b, a] < depths[k] + IN_FRONT:
                    continue
                value, weight = mean_of_four(brightness, u, v)
                if weight > LEAST_SEEN:
                    total += value
                    seen += weight
            lines[k, i] = total / max(seen, 1e-12)
            weights[k, i] = seen / (2 * beside + 1)


@compiled
def mean_of_four(image: NDArray[np.float64], u: float, v: float) -> tuple[float, float]:
    """Weighted sum of the pixels around a place that are not NaN, and of their weights (bilinear)."""
    height, width = image.shape
    a, b = int(np.floor(u)), int(np.floor(v))
    if a < 0 or b < 0 or a + 1 >= width or b + 1 >= height:
        return 0.0, 0.0
    x, y, total, weights = u - a, v - b, 0.0, 0.0
    for j in range(2):
        for i in range(2):
            value = image[b + j, a + i]
            if not np.isnan(value):
                weight = (x if i else 1.0 - x) * (y if j else 1.0 - y)
                total += weight * value
                weights += weight
    return total, weights


@compiled
def inward(
    shade: NDArray[np.float64],
    step: int,
    pixels: NDArray[np.float64],
    normals: NDArray[np.float64],
    expected: NDArray[np.float64],
    thickness: NDArray[np.int64],
    weights: NDArray[np.float64],
) -> None:
    """Say how bright the object should be along the lines, counted inward from its outline.

    Args:
        shade: Its expected brightness in the view's pixels, NaN beside it.
        step: See above.
        pixels: As in ``across``.
        normals: As in ``across``.
        expected: Filled with the brightness at 0, 1, 2, ... pixels inward, (N, depth).
        thickness: Filled with how many pixels inward the object ends again, at most ``depth``, (N,).
        weights: As in ``across``; becomes 0 from where the object begins again outward.
    """
    height, width = shade.shape
    depth, reach = expected.shape[1], (weights.shape[1] - 1) // 2
    for k in range(len(pixels)):
        thickness[k] = depth
        last, first = np.nan, np.nan
        for i in range(depth):
            a = int(np.rint((pixels[k, 0] - i * normals[k, 0]) / step))
            b = int(np.rint((pixels[k, 1] - i * normals[k, 1]) / step))
            if 0 <= a < width and 0 <= b < height and not np.isnan(shade[b, a]):
                last = shade[b, a]
                if np.isnan(first):
                    first = last
            elif i >= 2 * step:
                thickness[k] = i
                break
            expected[k, i] = last
        for i in range(min(2 * step, depth)):
            if np.isnan(expected[k, i]):
                expected[k, i] = first
        for i in range(reach + 1 + 2 * step, 2 * reach + 1):
            a = int(np.rint((pixels[k, 0] + (i - reach) * normals[k, 0]) / step))
            b = int(np.rint((pixels[k, 1] + (i - reach) * normals[k, 1]) / step))
            if 0 <= a < width and 0 <= b < height and not np.isnan(shade[b, a]):
                weights[k, i - 1 :] = 0.0
                break
