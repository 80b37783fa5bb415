# SPDX-License-Identifier: MIT
"""Where a ray meets a sphere, capsule, cylinder or box, and the normal there.

Each of them is convex, so a ray is in it over one interval of x, the distance in lengths of the ray: its point there
is p + x r, in the solid's frame. A box is where three slabs are at once, a cylinder where a pipe and a slab are, a
capsule what its cylinder and the balls at its ends span. An interval that ends before it begins is empty.
``size`` is MuJoCo's: radius and half the length (along z), or half the sides.
"""

from __future__ import annotations

import numpy as np

from ..compiled import inlined
from .vectors import Vector, dot

# MuJoCo's numbers for types of geoms (mjtGeom).
SPHERE, CAPSULE, CYLINDER, BOX, MESH = 2, 3, 5, 6, 7


@inlined
def in_slab(half: float, p: float, r: float) -> tuple[float, float]:
    """The interval over which |p + x r| <= half."""
    if r == 0.0:
        return (-np.inf, np.inf) if abs(p) <= half else (np.inf, -np.inf)
    middle, reach = -p / r, half / abs(r)
    return middle - reach, middle + reach


@inlined
def in_round(a: float, b: float, c: float) -> tuple[float, float]:
    """The interval over which a x^2 + 2 b x + c <= 0, for a >= 0."""
    if a == 0.0:
        return (-np.inf, np.inf) if c <= 0.0 else (np.inf, -np.inf)
    under = b * b - a * c
    if under < 0.0:
        return np.inf, -np.inf
    root = np.sqrt(under)
    return (-b - root) / a, (-b + root) / a


@inlined
def in_ball(radius: float, z: float, p: Vector, r: Vector) -> tuple[float, float]:
    """The interval in a ball about (0, 0, z)."""
    height = p[2] - z
    b = r[0] * p[0] + r[1] * p[1] + r[2] * height
    c = p[0] * p[0] + p[1] * p[1] + height * height - radius * radius
    return in_round(dot(r, r), b, c)


@inlined
def in_cylinder(size: Vector, p: Vector, r: Vector) -> tuple[float, float]:
    """The interval in a cylinder about z: in the pipe and in the slab."""
    a = r[0] * r[0] + r[1] * r[1]
    b = r[0] * p[0] + r[1] * p[1]
    c = p[0] * p[0] + p[1] * p[1] - size[0] * size[0]
    enter, leave = in_round(a, b, c)
    low, high = in_slab(size[1], p[2], r[2])
    return max(enter, low), min(leave, high)


@inlined
def in_capsule(size: Vector, p: Vector, r: Vector) -> tuple[float, float]:
    """The interval in a capsule about z: from the first of its three parts to the last."""
    enter, leave = in_cylinder(size, p, r)
    if enter > leave:
        enter, leave = np.inf, -np.inf
    for z in (size[1], -size[1]):
        low, high = in_ball(size[0], z, p, r)
        enter, leave = min(enter, low), max(leave, high)
    return enter, leave


@inlined
def in_box(size: Vector, p: Vector, r: Vector) -> tuple[float, float]:
    """The interval in a box: in three slabs."""
    enter, leave = -np.inf, np.inf
    for i in range(3):
        low, high = in_slab(size[i], p[i], r[i])
        enter, leave = max(enter, low), min(leave, high)
    return enter, leave


@inlined
def meet_solid(kind: int, size: Vector, p: Vector, r: Vector) -> float:
    """Distance to the surface of a solid, from outside or inside; -1 if it is never met."""
    if kind == SPHERE:
        enter, leave = in_ball(size[0], 0.0, p, r)
    elif kind == CAPSULE:
        enter, leave = in_capsule(size, p, r)
    elif kind == CYLINDER:
        enter, leave = in_cylinder(size, p, r)
    else:
        enter, leave = in_box(size, p, r)
    if enter > leave or leave < 0.0:
        return -1.0
    return enter if enter >= 0.0 else leave


@inlined
def solid_normal(kind: int, size: Vector, q: Vector, n: Vector) -> None:
    """Fill ``n`` with the normal, of any length, at point ``q`` on the surface: of the face it is nearest to."""
    n[0], n[1], n[2] = q[0], q[1], q[2]
    if kind == CAPSULE:
        n[2] = q[2] - min(max(q[2], -size[1]), size[1])
    elif kind == CYLINDER:
        above = abs(q[2]) - size[1]
        if np.sqrt(q[0] * q[0] + q[1] * q[1]) - size[0] >= above:
            n[2] = 0.0
        else:
            n[0], n[1] = 0.0, 0.0
    elif kind == BOX:
        face = 0
        for i in range(1, 3):
            if abs(q[i]) - size[i] > abs(q[face]) - size[face]:
                face = i
        for i in range(3):
            if i != face:
                n[i] = 0.0
