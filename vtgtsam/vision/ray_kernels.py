# SPDX-License-Identifier: MIT
"""Rays through a distance field: the depth image that an object would make.

A camera is passed as (fx, fy, cx, cy) and its pose in the object frame as ``R_oc`` (3, 3) and ``t_oc`` (3,);
a distance field as in ``vtgtsam.sdf.kernels``; ``box`` (2, 3) are two corners around the object [m]. Rays are
counted in depths: a ray's point at depth z is t_oc + z * direction.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled, inlined
from ..sdf.kernels import trilinear

THIN = 0.5  # [cells], what the field says in the middle of a wall without thickness, at most
BESIDE = 3.0  # [cells], so far before and behind a wall its gradients are looked at:
OPPOSITE = -0.5  # their product, at most


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


@inlined
def along(
    values: NDArray[np.float32],
    lower: NDArray[np.float64],
    scale: NDArray[np.float64],
    origin: NDArray[np.float64],
    direction: NDArray[np.float64],
    at: float,
) -> tuple[float, float, float, float]:
    """Distance and gradient, as ``trilinear`` has them, at a depth of a ray."""
    x = origin[0] + at * direction[0]
    y = origin[1] + at * direction[1]
    z = origin[2] + at * direction[2]
    return trilinear(values, lower, scale, x, y, z)


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
    _, ax, ay, az = along(values, lower, scale, origin, direction, at - BESIDE * cell)
    _, bx, by, bz = along(values, lower, scale, origin, direction, at + BESIDE * cell)
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
        phi = along(values, lower, scale, origin, direction, at)[0]
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
        free = along(values, lower, scale, origin, direction, at)[0] - at * opening
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
        phi = along(values, lower, scale, origin, direction, at)[0]
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
def normals(
    values: NDArray[np.float32],
    lower: NDArray[np.float64],
    scale: NDArray[np.float64],
    camera: NDArray[np.float64],
    R_oc: NDArray[np.float64],
    t_oc: NDArray[np.float64],
    depth: NDArray[np.float64],
    normals_c: NDArray[np.float64],
) -> None:
    """Fill ``normals_c`` (height, width, 3) with the unit normals of a rendered surface, camera frame; NaN beside it.

    They are taken half a cell before it, where a thin wall's other side does not mix in.
    """
    direction = np.empty(3)
    for v in range(depth.shape[0]):
        for u in range(depth.shape[1]):
            if depth[v, u] == np.inf:
                normals_c[v, u, :] = np.nan
                continue
            ray(camera, R_oc, u, v, direction)
            _, gx, gy, gz = along(
                values, lower, scale, t_oc, direction, depth[v, u] - 0.5 / scale[0]
            )
            length = max(np.sqrt(gx * gx + gy * gy + gz * gz), 1e-12)
            for i in range(3):
                normals_c[v, u, i] = (R_oc[0, i] * gx + R_oc[1, i] * gy + R_oc[2, i] * gz) / length
