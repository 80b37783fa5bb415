# SPDX-License-Identifier: MIT
"""What the pixels of a depth image say about an object's pose.

Arguments are as in ``ray_kernels``.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from .ray_kernels import along, deepest, ray

# What a pixel says about a pose.
NOTHING, SURFACE, THROUGH, COVERED, NEARER = 0, 1, 2, 3, 4

CLEAR = 6  # [pixels], so far from a known hand its depth does not spread; what is nearer there is the object
REACH = 0.03  # [m], and no farther from where the pose puts it; else it is something unknown

# In a thin wall the gradient is a mean of its two sides, shorter than 1 (squared): a cell or two before, it is not.
BLURRED, BEFORE = 0.5, 1.5  # [-], [cells]


@compiled
def may_be_hand(hand_depth: NDArray[np.float64], u: int, v: int, predicted: float) -> bool:
    """Whether the hand is near enough to a pixel, and in front of what is predicted there, to cover it."""
    height, width = hand_depth.shape
    for b in range(max(v - CLEAR, 0), min(v + CLEAR + 1, height)):
        for a in range(max(u - CLEAR, 0), min(u + CLEAR + 1, width)):
            if hand_depth[b, a] < predicted:
                return True
    return False


@compiled
def classify(
    predicted: NDArray[np.float64],
    depth: NDArray[np.float64],
    hand: NDArray[np.bool_],
    hand_depth: NDArray[np.float64],
    sigma: float,
    excess: NDArray[np.float64],
    alike: float,
    limits: NDArray[np.float64],
    size: int,
    kind: NDArray[np.uint8],
) -> float:
    """Say what each pixel tells about the object, from the predicted and the measured depth [m].

    A pixel whose two depths differ by more than the first limit is decided by itself. A fingertip that lies
    on the object differs less than that, but it covers several pixels side by side: for the others the mean
    difference over a window, among the undecided and weighed by their noise, must be below the second limit.
    What is nearer than predicted covers the object, unless the hand is known and is not there: then it is the
    object, and the pose puts it too far behind.

    Args:
        predicted: Depth of the object alone, inf where the pose puts no object.
        depth: Measured depth, 0 where there is none.
        hand: Where the hand is known to be: such a pixel is no surface, but one can see through it.
        hand_depth: Depth of the hand alone [m], inf beside it; -inf everywhere for a hand that is not known.
        sigma: Standard deviation of the noise [m].
        excess: What edges add to it [m]; variances are its square, whatever its sign.
        alike: How many pixels of a window err together, on average; 1 for independent noise.
        limits: Largest difference of one pixel [sigma], of a window's mean [sigma of a pixel, if independent],
            what the pose may be off, which is added to both [m], and what a right model may be off [m].
        size: The window reaches this many pixels to each side.
        kind: Filled with NOTHING, SURFACE, THROUGH, COVERED or NEARER.

    Returns:
        Mean square of the windows' means in units of what noise and the model's error let expect, over the
        pixels of the surface: about 1 at the right pose; 0 where there is no such pixel.
    """
    height, width = depth.shape
    for v in range(height):
        for u in range(width):
            difference = depth[v, u] - predicted[v, u]
            limit = limits[0] * np.sqrt(sigma * sigma + excess[v, u] ** 2) + limits[2]
            if depth[v, u] <= 0.0 or predicted[v, u] == np.inf:
                kind[v, u] = NOTHING
            elif difference > limit:
                kind[v, u] = THROUGH
            elif hand[v, u]:
                kind[v, u] = COVERED
            elif difference < -limit:
                kind[v, u] = NEARER
            else:
                kind[v, u] = SURFACE
    undecided = kind.copy()
    misfit, surface = 0.0, 0
    for v in range(height):
        for u in range(width):
            if undecided[v, u] != SURFACE:
                continue
            total, weights, count = 0.0, 0.0, 0
            for b in range(max(v - size, 0), min(v + size + 1, height)):
                for a in range(max(u - size, 0), min(u + size + 1, width)):
                    if undecided[b, a] == SURFACE:
                        weight = 1.0 / (sigma * sigma + excess[b, a] ** 2)
                        total += weight * (depth[b, a] - predicted[b, a])
                        weights += weight
                        count += 1
            mean = total / weights
            limit = limits[1] * np.sqrt(alike * (sigma * sigma + excess[v, u] ** 2)) + limits[2]
            if mean > limit:
                kind[v, u] = THROUGH
            elif mean < -limit:
                kind[v, u] = NEARER
            else:
                surface += 1
                expected = min(alike, count) / weights + limits[3] * limits[3]
                misfit += mean * mean / expected
    for v in range(height):
        for u in range(width):
            if kind[v, u] == NEARER and may_be_hand(hand_depth, u, v, predicted[v, u]):
                kind[v, u] = COVERED
    return misfit / max(surface, 1)


@compiled
def accumulate(
    values: NDArray[np.float32],
    lower: NDArray[np.float64],
    scale: NDArray[np.float64],
    camera: NDArray[np.float64],
    R_oc: NDArray[np.float64],
    t_oc: NDArray[np.float64],
    depth: NDArray[np.float64],
    predicted: NDArray[np.float64],
    kind: NDArray[np.uint8],
    sigma: float,
    excess: NDArray[np.float64],
    grazing: float,
    cutoff: NDArray[np.float64],
    common: float,
    information: NDArray[np.float64],
    gradient: NDArray[np.float64],
    moments: NDArray[np.float64],
) -> None:
    """Add the normal equations of all pixels, for a right perturbation [rotation, translation].

    SURFACE: the measured depth z and the depth d of the surface point s_o predicted there differ along the ray
    r (one unit of depth long) by the plane distance

        e = (z - d) g . r,    g = grad phi(s_o),    de/dxi = [ (g x s_o)^T  -g^T ]

    with Tukey's weight up to a difference of ``cutoff`` ([sigma], and [m] added to it). It is linear in z. The
    distance phi of the measured point itself is not: where the surface curves away or is seen at a flat angle,
    noise alone would raise it, and a pose half covered by fingers would be off by millimetres.

    THROUGH: the error is phi at the deepest point of the ray, which must come out of the object; it has at most
    the influence of one sigma (Huber).

    NEARER: the error is phi at the measured point, to which the object must come; as above.

    What edges add to the noise, ``excess``, is partly the same along all of them: one more unknown b, of standard
    deviation 1, with de/db = common excess g . r. Its row and column are the last, ``information`` is (7, 7) and
    ``gradient`` (7,).

    ``moments`` (4, 4) becomes the sum of w [s_o; 1] [s_o; 1]^T over the surface's pixels.
    """
    direction, row, point = np.empty(3), np.empty(7), np.ones(4)
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            if kind[v, u] == NOTHING or kind[v, u] == COVERED:
                continue
            ray(camera, R_oc, u, v, direction)
            at, difference = predicted[v, u], depth[v, u] - predicted[v, u]
            noise = np.sqrt(sigma * sigma + excess[v, u] ** 2)
            reach = cutoff[0] * noise + cutoff[1]
            if kind[v, u] == THROUGH:
                at = deepest(values, lower, scale, t_oc, direction, at, depth[v, u])
            elif kind[v, u] == NEARER:
                at = depth[v, u]
            elif abs(difference) >= reach:
                continue
            px = t_oc[0] + at * direction[0]
            py = t_oc[1] + at * direction[1]
            pz = t_oc[2] + at * direction[2]
            phi, gx, gy, gz = along(values, lower, scale, t_oc, direction, at)
            if kind[v, u] != SURFACE:
                if kind[v, u] == THROUGH and phi > 0.0:
                    continue  # a wall without an inside
                if kind[v, u] == NEARER and not 0.0 < phi < REACH:
                    continue
                error, weight, row[6] = phi, 1.0 / (noise * max(abs(phi), noise)), 0.0
            else:
                slope = gx * direction[0] + gy * direction[1] + gz * direction[2]
                if slope > 0.0 or gx * gx + gy * gy + gz * gz < BLURRED:
                    back = BEFORE / (scale[0] * np.sqrt(direction @ direction))
                    phi, gx, gy, gz = along(values, lower, scale, t_oc, direction, at - back)
                    slope = gx * direction[0] + gy * direction[1] + gz * direction[2]
                error, tukey = difference * slope, 1.0 - (difference / reach) ** 2
                weight = tukey * tukey / (noise * noise * (slope * slope + grazing * grazing))
                row[6] = common * excess[v, u] * slope
                point[0], point[1], point[2] = px, py, pz
                for i in range(4):
                    for j in range(4):
                        moments[i, j] += weight * point[i] * point[j]
            row[0], row[1], row[2] = gy * pz - gz * py, gz * px - gx * pz, gx * py - gy * px
            row[3], row[4], row[5] = -gx, -gy, -gz
            for i in range(7):
                gradient[i] += weight * error * row[i]
                for j in range(i + 1):
                    information[i, j] += weight * row[i] * row[j]
    for i in range(7):
        for j in range(i):
            information[j, i] = information[i, j]
