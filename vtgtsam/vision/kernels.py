# SPDX-License-Identifier: MIT
"""The compiled loops of the depth tracker.

A camera is passed as (fx, fy, cx, cy) and its pose in the object frame as ``R_oc`` (3, 3) and ``t_oc`` (3,);
a distance field as in ``vtgtsam.sdf.kernels``; ``box`` (2, 3) are two corners around the object [m]. Rays are
counted in depths: a ray's point at depth z is t_oc + z * direction.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled
from ..sdf.kernels import trilinear

# What a pixel says about a pose.
NOTHING, SURFACE, THROUGH, COVERED = 0, 1, 2, 3

THIN = 0.5  # [cells], what the field says in the middle of a wall without thickness, at most
BESIDE, OPPOSITE = (
    3.0,
    -0.5,
)  # [cells] before and behind it, and the product of the gradients there, at most
# In a thin wall the gradient is a mean of its two sides, shorter than 1 (squared): a cell or two before, it is not.
BLURRED, BEFORE = 0.5, 1.5  # [-], [cells]


@compiled
def depth_range(
    box: NDArray[np.float64],
    origin: NDArray[np.float64],
    direction: NDArray[np.float64],
    width: float,
) -> tuple[float, float]:
    """Where a ray enters and leaves a box grown by ``width`` [m] a side; enter > leave: never."""
    enter, leave = 0.0, np.inf
    for axis in range(3):
        low, high = box[0, axis] - width - origin[axis], box[1, axis] + width - origin[axis]
        if direction[axis] == 0.0:
            if low > 0.0 or high < 0.0:
                return 1.0, 0.0
            continue
        a, b = low / direction[axis], high / direction[axis]
        enter, leave = max(enter, min(a, b)), min(leave, max(a, b))
    return enter, leave


@compiled
def ray(
    camera: NDArray[np.float64],
    R_oc: NDArray[np.float64],
    u: float,
    v: float,
    direction: NDArray[np.float64],
) -> None:
    """Fill ``direction`` (3,) with the ray of a pixel, one unit of depth long, object frame."""
    x, y = (u - camera[2]) / camera[0], (v - camera[3]) / camera[1]
    for axis in range(3):
        direction[axis] = R_oc[axis, 0] * x + R_oc[axis, 1] * y + R_oc[axis, 2]


@compiled
def is_wall(
    values: NDArray[np.float32],
    lower: NDArray[np.float64],
    scale: NDArray[np.float64],
    origin: NDArray[np.float64],
    direction: NDArray[np.float64],
    at: float,
    phi: float,
    cell: float,
) -> bool:
    """Whether a ray goes through a wall too thin for the field, at a depth where the distance phi is least.

    Before and behind a wall the gradients point away from each other; along a surface that the ray only passes
    they are much the same.

    Args:
        values: The field.
        lower: See above.
        scale: See above.
        origin: The ray's.
        direction: The ray's.
        at: The depth [m].
        phi: The distance there [m].
        cell: One of the field's cells along the ray, in depth [m].
    """
    if phi * scale[0] > THIN:
        return False
    near, far = at - BESIDE * cell, at + BESIDE * cell
    _, ax, ay, az = trilinear(
        values,
        lower,
        scale,
        origin[0] + near * direction[0],
        origin[1] + near * direction[1],
        origin[2] + near * direction[2],
    )
    _, bx, by, bz = trilinear(
        values,
        lower,
        scale,
        origin[0] + far * direction[0],
        origin[1] + far * direction[1],
        origin[2] + far * direction[2],
    )
    return ax * bx + ay * by + az * bz < OPPOSITE


@compiled
def trace(
    values: NDArray[np.float32],
    lower: NDArray[np.float64],
    scale: NDArray[np.float64],
    origin: NDArray[np.float64],
    direction: NDArray[np.float64],
    start: float,
    end: float,
) -> float:
    """Depth at which a ray meets the surface, between two depths; inf where it passes by.

    Sphere tracing: the distance field says how far the ray may go on without meeting the surface. The
    crossing itself is interpolated between the last point outside and the first inside. A wall thinner than the
    field's cells has no inside: there it is where the ray is nearest to it (``is_wall``).
    """
    speed = np.sqrt(direction[0] ** 2 + direction[1] ** 2 + direction[2] ** 2)
    least = 0.3 / (
        scale[0] * speed
    )  # a third of a cell: near the surface the steps must not die out
    at, before, phi_before = start, start, np.inf
    while at <= end:
        x = origin[0] + at * direction[0]
        y = origin[1] + at * direction[1]
        z = origin[2] + at * direction[2]
        phi = trilinear(values, lower, scale, x, y, z)[0]
        if phi <= 0.0:
            if phi_before == np.inf:
                return at
            return before + (at - before) * phi_before / (phi_before - phi)
        if phi > phi_before and is_wall(
            values, lower, scale, origin, direction, before, phi_before, 1.0 / (scale[0] * speed)
        ):
            return before
        before, phi_before = at, phi
        at += max(phi / speed, least)
    return np.inf


@compiled
def trace_cone(
    values: NDArray[np.float32],
    lower: NDArray[np.float64],
    scale: NDArray[np.float64],
    origin: NDArray[np.float64],
    direction: NDArray[np.float64],
    start: float,
    end: float,
    opening: float,
) -> float:
    """Depth up to which a bundle of rays meets nothing; inf where none of them meets the surface.

    The bundle's rays are at most ``opening`` times the depth away from the ray given.
    """
    speed = np.sqrt(direction[0] ** 2 + direction[1] ** 2 + direction[2] ** 2) + opening
    cell = 1.0 / scale[0]
    at = start
    while at <= end:
        x = origin[0] + at * direction[0]
        y = origin[1] + at * direction[1]
        z = origin[2] + at * direction[2]
        free = trilinear(values, lower, scale, x, y, z)[0] - at * opening
        if free < cell:
            return at
        at += free / speed
    return np.inf


@compiled
def deepest(
    values: NDArray[np.float32],
    lower: NDArray[np.float64],
    scale: NDArray[np.float64],
    origin: NDArray[np.float64],
    direction: NDArray[np.float64],
    start: float,
    end: float,
) -> float:
    """Where a ray is deepest inside the object, from its first surface point until it is out again.

    Where the camera sees through the modelled object, that is the point which has to come out of it.
    """
    speed = np.sqrt(direction[0] ** 2 + direction[1] ** 2 + direction[2] ** 2)
    least = 1.0 / (scale[0] * speed)
    at, lowest, place = start + least, 0.0, start
    while at <= end:
        x = origin[0] + at * direction[0]
        y = origin[1] + at * direction[1]
        z = origin[2] + at * direction[2]
        phi = trilinear(values, lower, scale, x, y, z)[0]
        if phi > 0.0:
            break
        if phi < lowest:
            lowest, place = phi, at
        at += max((phi - lowest) / speed, least)  # nothing deeper is nearer than that
    return place


@compiled
def render(
    values: NDArray[np.float32],
    lower: NDArray[np.float64],
    scale: NDArray[np.float64],
    box: NDArray[np.float64],
    camera: NDArray[np.float64],
    R_oc: NDArray[np.float64],
    t_oc: NDArray[np.float64],
    depth: NDArray[np.float64],
) -> None:
    """Fill ``depth`` (height, width) with the object's predicted depth [m], inf where it is not seen.

    Blocks of 4 x 4 pixels are traced together first: most of them pass by the object, and in the others each
    ray starts close to it.
    """
    height, width = depth.shape
    # Half a block's diagonal at depth 1; and at the depth of the object, with much to spare.
    opening = 1.5 * np.sqrt(1.0 / camera[0] ** 2 + 1.0 / camera[1] ** 2)
    reach = 1.5 * opening * np.sqrt(t_oc[0] ** 2 + t_oc[1] ** 2 + t_oc[2] ** 2)
    direction = np.empty(3)
    for top in range(0, height, 4):
        for left in range(0, width, 4):
            ray(camera, R_oc, left + 1.5, top + 1.5, direction)
            start, end = depth_range(box, t_oc, direction, reach)
            start = trace_cone(values, lower, scale, t_oc, direction, start, end, opening)
            for v in range(top, min(top + 4, height)):
                for u in range(left, min(left + 4, width)):
                    depth[v, u] = np.inf
                    if start < np.inf:
                        ray(camera, R_oc, u, v, direction)
                        depth[v, u] = trace(values, lower, scale, t_oc, direction, start, end)


@compiled
def classify(
    predicted: NDArray[np.float64],
    depth: NDArray[np.float64],
    hand: NDArray[np.bool_],
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

    Args:
        predicted: Depth of the object alone, inf where the pose puts no object.
        depth: Measured depth, 0 where there is none.
        hand: Where the hand is known to be: such a pixel is no surface, but one can see through it.
        sigma: Standard deviation of the noise [m].
        excess: What edges add to it [m]; variances are its square, whatever its sign.
        alike: How many pixels of a window err together, on average; 1 for independent noise.
        limits: Largest difference of one pixel [sigma], of a window's mean [sigma of a pixel, if independent],
            what the pose may be off, which is added to both [m], and what a right model may be off [m].
        size: The window reaches this many pixels to each side.
        kind: Filled with NOTHING, SURFACE, THROUGH or COVERED.

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
            elif difference < -limit or hand[v, u]:
                kind[v, u] = COVERED
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
                kind[v, u] = COVERED
            else:
                surface += 1
                expected = min(alike, count) / weights + limits[3] * limits[3]
                misfit += mean * mean / expected
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

    What edges add to the noise, ``excess``, is partly the same along all of them: one more unknown b, of standard
    deviation 1, with de/db = common excess g . r. Its row and column are the last, ``information`` is (7, 7) and
    ``gradient`` (7,).
    """
    direction, row = np.empty(3), np.empty(7)
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            if kind[v, u] != SURFACE and kind[v, u] != THROUGH:
                continue
            ray(camera, R_oc, u, v, direction)
            at, difference = predicted[v, u], depth[v, u] - predicted[v, u]
            noise = np.sqrt(sigma * sigma + excess[v, u] ** 2)
            reach = cutoff[0] * noise + cutoff[1]
            if kind[v, u] == THROUGH:
                at = deepest(values, lower, scale, t_oc, direction, at, depth[v, u])
            elif abs(difference) >= reach:
                continue
            px = t_oc[0] + at * direction[0]
            py = t_oc[1] + at * direction[1]
            pz = t_oc[2] + at * direction[2]
            phi, gx, gy, gz = trilinear(values, lower, scale, px, py, pz)
            if kind[v, u] == THROUGH:
                if phi > 0.0:
                    continue  # a wall without an inside
                error, weight, row[6] = phi, 1.0 / (noise * max(-phi, noise)), 0.0
            else:
                slope = gx * direction[0] + gy * direction[1] + gz * direction[2]
                if slope > 0.0 or gx * gx + gy * gy + gz * gz < BLURRED:
                    back = BEFORE / (scale[0] * np.sqrt(direction @ direction))
                    phi, gx, gy, gz = trilinear(
                        values,
                        lower,
                        scale,
                        px - back * direction[0],
                        py - back * direction[1],
                        pz - back * direction[2],
                    )
                    slope = gx * direction[0] + gy * direction[1] + gz * direction[2]
                error, tukey = difference * slope, 1.0 - (difference / reach) ** 2
                weight = tukey * tukey / (noise * noise * (slope * slope + grazing * grazing))
                row[6] = common * excess[v, u] * slope
            row[0], row[1], row[2] = gy * pz - gz * py, gz * px - gx * pz, gx * py - gy * px
            row[3], row[4], row[5] = -gx, -gy, -gz
            for i in range(7):
                gradient[i] += weight * error * row[i]
                for j in range(i + 1):
                    information[i, j] += weight * row[i] * row[j]
    for i in range(7):
        for j in range(i):
            information[j, i] = information[i, j]


@compiled
def zones(
    front: NDArray[np.float64],
    predicted: NDArray[np.float64],
    jump: float,
    steep: float,
    near: int,
    zone: NDArray[np.int64],
) -> None:
    """Say how many pixels away an edge is, for each pixel of the object that nothing covers.

    ``zone`` (height, width) gets steps - 1 where the nearest other depth is smaller than the object's, near + steps
    - 1 where it is larger, and is left as it is where there is none within ``near`` steps, diagonal ones included.
    An edge is a difference of more than ``jump`` [m] and ``steep`` times the depth for each step.

    Args:
        front: What the camera should see [m], inf where that is nothing, shape (height, width).
        predicted: The object alone, same shape.
        jump: See above.
        steep: See above.
        near: See above.
        zone: See above.
    """
    height, width = front.shape
    for v in range(height):
        for u in range(width):
            z = predicted[v, u]
            if z == np.inf or front[v, u] < z - jump:
                continue
            found = False
            for steps in range(1, near + 1):
                least = jump + steep * z * steps
                nearer, farther = False, False
                for b in range(max(v - steps, 0), min(v + steps + 1, height)):
                    whole = abs(b - v) == steps
                    for a in range(max(u - steps, 0), min(u + steps + 1, width)):
                        if whole or abs(a - u) == steps:
                            nearer = nearer or front[b, a] < z - least
                            farther = farther or front[b, a] > z + least
                if nearer or farther:
                    zone[v, u] = steps - 1 if nearer else near + steps - 1
                    found = True
                if found:
                    break


@compiled
def products(residual: NDArray[np.float64], lags: int, sums: NDArray[np.float64]) -> None:
    """Add products of residuals (height, width) some pixels apart in a row and a column; NaN where there is none.

    ``sums`` (2, lags + 1, 2) gets, for rows and columns and each lag from 0, the sum of the products and of the
    mean squares of the two.
    """
    height, width = residual.shape
    for v in range(height):
        for u in range(width):
            r = residual[v, u]
            if np.isnan(r):
                continue
            for lag in range(lags + 1):
                for axis in range(2):
                    b, a = (v, u + lag) if axis == 0 else (v + lag, u)
                    if b < height and a < width and not np.isnan(residual[b, a]):
                        other = residual[b, a]
                        sums[axis, lag, 0] += r * other
                        sums[axis, lag, 1] += 0.5 * (r * r + other * other)
