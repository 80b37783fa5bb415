# SPDX-License-Identifier: MIT
"""The compiled loops of the depth tracker.

A camera is passed as (fx, fy, cx, cy), its pose in the object frame as ``R_oc`` (3, 3) and ``t_oc`` (3,);
a distance field as in ``vtgtsam.sdf.kernels``.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from ..compiled import compiled
from ..sdf.kernels import trilinear

# What one pixel says about a pose.
NOTHING, SURFACE, THROUGH, COVERED, BESIDE = 0, 1, 2, 3, 4


@compiled
def enter_and_leave(shape: Any, lower: Any, scale: Any, origin: Any, direction: Any) -> Any:
    """Where a ray enters and leaves the grid's box, in lengths of ``direction``; enter > leave: never."""
    enter, leave = 0.0, np.inf
    for axis in range(3):
        first, last = lower[axis], lower[axis] + (shape[axis] - 1) / scale[axis]
        if direction[axis] == 0.0:
            if origin[axis] < first or origin[axis] > last:
                return 1.0, 0.0
            continue
        a, b = (first - origin[axis]) / direction[axis], (last - origin[axis]) / direction[axis]
        enter, leave = max(enter, min(a, b)), min(leave, max(a, b))
    return enter, leave


@compiled
def trace(values: Any, lower: Any, scale: Any, origin: Any, direction: Any) -> Any:
    """Length of a ray up to the surface, in lengths of ``direction``; inf where it passes by.

    Sphere tracing: the distance field says how far the ray may go on without meeting the surface. The
    crossing itself is interpolated between the last point outside and the first inside.
    """
    at, leave = enter_and_leave(values.shape, lower, scale, origin, direction)
    speed = np.sqrt(direction[0] ** 2 + direction[1] ** 2 + direction[2] ** 2)
    least = 0.3 / (
        scale[0] * speed
    )  # a third of a cell: near the surface the steps must not die out
    before, phi_before = at, np.inf
    while at <= leave:
        x = origin[0] + at * direction[0]
        y = origin[1] + at * direction[1]
        z = origin[2] + at * direction[2]
        phi = trilinear(values, lower, scale, x, y, z)[0]
        if phi <= 0.0:
            if phi_before == np.inf:
                return at
            return before + (at - before) * phi_before / (phi_before - phi)
        before, phi_before = at, phi
        at += max(phi / speed, least)
    return np.inf


@compiled
def deepest(
    values: Any, lower: Any, scale: Any, origin: Any, direction: Any, start: float, end: float
) -> Any:
    """The deepest point on a part of a ray that starts at the surface: its phi and its place.

    Used where the camera sees through the modelled object: that point must come out of the object.
    """
    speed = np.sqrt(direction[0] ** 2 + direction[1] ** 2 + direction[2] ** 2)
    least = 1.0 / (scale[0] * speed)
    at, lowest, place = start + least, 0.0, start
    end = min(end, enter_and_leave(values.shape, lower, scale, origin, direction)[1])
    while at <= end:
        x = origin[0] + at * direction[0]
        y = origin[1] + at * direction[1]
        z = origin[2] + at * direction[2]
        phi = trilinear(values, lower, scale, x, y, z)[0]
        if phi < lowest:
            lowest, place = phi, at
        if phi > 0.0:  # out again
            break
        at += max((phi - lowest) / speed, least)  # no deeper point is nearer than that
    return lowest, place


@compiled
def render(
    values: Any, lower: Any, scale: Any, camera: Any, R_oc: Any, t_oc: Any, depth: Any
) -> None:
    """Fill ``depth`` (height, width) with the object's predicted depth [m], inf where it is not seen."""
    direction = np.empty(3)
    for v in range(depth.shape[0]):
        y = (v - camera[3]) / camera[1]
        for u in range(depth.shape[1]):
            x = (u - camera[2]) / camera[0]
            for axis in range(3):
                direction[axis] = R_oc[axis, 0] * x + R_oc[axis, 1] * y + R_oc[axis, 2]
            depth[v, u] = trace(values, lower, scale, t_oc, direction)


@compiled
def classify(predicted: Any, depth: Any, behind: float, front: float, size: int, kind: Any) -> None:
    """Say what each pixel tells about the object, from the predicted and the measured depth [m].

    A single pixel's noise is as large as what tells a fingertip from the surface below it, but what covers
    the object covers several pixels side by side. So the mean difference over a window decides.

    Args:
        predicted: Depth of the object alone, inf where the pose puts no object.
        depth: Measured depth, 0 where there is none.
        behind: The camera sees through the modelled object where it measures more than this behind it [m].
        front: Something covers the object where the mean measurement is more than this in front of it [m].
        size: The window reaches this many pixels to each side.
        kind: Filled with NOTHING, SURFACE, THROUGH, COVERED or BESIDE (measured outside the outline).
    """
    height, width = depth.shape
    for v in range(height):
        for u in range(width):
            if depth[v, u] <= 0.0:
                kind[v, u] = NOTHING
            elif predicted[v, u] == np.inf:
                kind[v, u] = BESIDE
            else:
                total, count = 0.0, 0
                for b in range(max(v - size, 0), min(v + size + 1, height)):
                    for a in range(max(u - size, 0), min(u + size + 1, width)):
                        if depth[b, a] > 0.0 and predicted[b, a] < np.inf:
                            difference = depth[b, a] - predicted[b, a]
                            # Beyond this it is something else, and no mean should hide that.
                            total += min(max(difference, -4.0 * front), 4.0 * front)
                            count += 1
                mean = total / count
                if mean > behind:
                    kind[v, u] = THROUGH
                elif mean < -front:
                    kind[v, u] = COVERED
                else:
                    kind[v, u] = SURFACE


@compiled
def accumulate(
    values: Any,
    lower: Any,
    scale: Any,
    camera: Any,
    R_oc: Any,
    t_oc: Any,
    depth: Any,
    predicted: Any,
    kind: Any,
    sigma: float,
    cutoff: float,
    beside: float,
    information: Any,
    gradient: Any,
) -> None:
    """Add the normal equations of all pixels, for a right perturbation [rotation, translation].

    A measured point p_o has the error phi(p_o), with Tukey's weight up to ``cutoff`` [m]; pixels beside the
    outline count ``beside`` times. Where the camera sees through the object the error is the depth by which the
    ray pierces it, with the influence of a residual at sigma at most (Huber).

        d phi / d xi = [ (grad phi x p_o)^T  -grad phi^T ]
    """
    direction, row = np.empty(3), np.empty(6)
    for v in range(depth.shape[0]):
        y = (v - camera[3]) / camera[1]
        for u in range(depth.shape[1]):
            if kind[v, u] == NOTHING or kind[v, u] == COVERED:
                continue
            x = (u - camera[2]) / camera[0]
            for axis in range(3):
                direction[axis] = R_oc[axis, 0] * x + R_oc[axis, 1] * y + R_oc[axis, 2]
            at, weight = depth[v, u], 1.0
            if kind[v, u] == THROUGH:
                lowest, at = deepest(values, lower, scale, t_oc, direction, predicted[v, u], at)
                weight = sigma / max(-lowest, sigma)
            px = t_oc[0] + at * direction[0]
            py = t_oc[1] + at * direction[1]
            pz = t_oc[2] + at * direction[2]
            phi, gx, gy, gz = trilinear(values, lower, scale, px, py, pz)
            if kind[v, u] != THROUGH:
                if abs(phi) >= cutoff:
                    continue
                weight = (1.0 - (phi / cutoff) ** 2) ** 2
                if kind[v, u] == BESIDE:
                    weight *= beside
            row[0], row[1], row[2] = gy * pz - gz * py, gz * px - gx * pz, gx * py - gy * px
            row[3], row[4], row[5] = -gx, -gy, -gz
            weight /= sigma * sigma
            for i in range(6):
                gradient[i] += weight * phi * row[i]
                for j in range(i + 1):
                    information[i, j] += weight * row[i] * row[j]
    for i in range(6):
        for j in range(i):
            information[j, i] = information[i, j]
