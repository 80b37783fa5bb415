# SPDX-License-Identifier: MIT
"""Where a ray meets a sphere, capsule, cylinder or box, and the normal there.

The formulas are MuJoCo's (``engine_ray.c``, Apache License 2.0), in its order, so that results agree to the last
bit. All is in the solid's frame: a ray's point at distance x (in lengths of the ray) is p + x r; -1 stands for never.
``size`` is MuJoCo's: radius and half the length, or half the sides. ``face`` says which part of the solid was met.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import inlined

Vector = NDArray[np.float64]

# MuJoCo's numbers for types of geoms (mjtGeom).
SPHERE, CAPSULE, CYLINDER, BOX, MESH = 2, 3, 5, 6, 7
TINY = 1e-15  # mjMINVAL


@inlined
def roots(a: float, b: float, c: float) -> tuple[float, float]:
    """Both solutions of a x^2 + 2 b x + c = 0, the smaller one first; -1 twice where there are none."""
    determinant = b * b - a * c
    if determinant < 0.0 or a < TINY:
        return -1.0, -1.0
    root = np.sqrt(determinant)
    return (-b - root) / a, (-b + root) / a


@inlined
def first_root(a: float, b: float, c: float) -> float:
    """The smallest solution that is not negative, or -1."""
    x, y = roots(a, b, c)
    if x >= 0.0:
        return x
    return y if y >= 0.0 else -1.0


@inlined
def bounding_radius_squared(kind: int, size: Vector) -> float:
    """Square of the radius [m] of the sphere around a solid."""
    if kind == SPHERE:
        return size[0] * size[0]  # type: ignore[no-any-return]
    if kind == CAPSULE:
        return (size[0] + size[1]) * (size[0] + size[1])  # type: ignore[no-any-return]
    if kind == CYLINDER:
        return size[0] * size[0] + size[1] * size[1]  # type: ignore[no-any-return]
    return size[0] * size[0] + size[1] * size[1] + size[2] * size[2]  # type: ignore[no-any-return]


@inlined
def meet_side(size: Vector, p: Vector, r: Vector) -> float:
    """Distance to the round side of a cylinder or capsule about z."""
    a = r[0] * r[0] + r[1] * r[1]
    b = r[0] * p[0] + r[1] * p[1]
    c = p[0] * p[0] + p[1] * p[1] - size[0] * size[0]
    x = first_root(a, b, c)
    return x if x >= 0.0 and abs(p[2] + x * r[2]) <= size[1] else -1.0


@inlined
def meet_capsule(size: Vector, p: Vector, r: Vector) -> tuple[float, int]:
    """Distance to a capsule about z; its face is 0 round the side, 1 at the top, -1 at the bottom."""
    x, face = meet_side(size, p, r), 0
    for end in (1, -1):
        z = p[2] - end * size[1]
        a = r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
        b = r[0] * p[0] + r[1] * p[1] + r[2] * z
        c = p[0] * p[0] + p[1] * p[1] + z * z - size[0] * size[0]
        for y in roots(a, b, c):
            if y >= 0.0 and end * (p[2] + y * r[2]) >= size[1] and (x < 0.0 or y < x):
                x, face = y, end
    return x, face


@inlined
def meet_cylinder(size: Vector, p: Vector, r: Vector) -> tuple[float, int]:
    """Distance to a cylinder about z; its face is 0 round the side, 1 at the top, -1 at the bottom."""
    x, face = -1.0, 0
    if abs(r[2]) > TINY:
        for end in (-1, 1):
            y = (end * size[1] - p[2]) / r[2]
            if y >= 0.0 and (x < 0.0 or y < x):
                at_0, at_1 = p[0] + y * r[0], p[1] + y * r[1]
                if at_0 * at_0 + at_1 * at_1 <= size[0] * size[0]:
                    x, face = y, end
    y = meet_side(size, p, r)
    if y >= 0.0 and (x < 0.0 or y < x):
        x, face = y, 0
    return x, face


@inlined
def meet_box(size: Vector, p: Vector, r: Vector) -> tuple[float, int]:
    """Distance to a box; its face is 1, 2 or 3 for +x, +y, +z, negative for the opposite ones."""
    x, face = -1.0, 0
    for i in range(3):
        if abs(r[i]) > TINY:
            j, k = 0 if i > 0 else 1, 2 if i < 2 else 1
            for side in (-1, 1):
                y = (side * size[i] - p[i]) / r[i]
                if y >= 0.0 and (x < 0.0 or y < x):
                    if abs(p[j] + y * r[j]) <= size[j] and abs(p[k] + y * r[k]) <= size[k]:
                        x, face = y, side * (i + 1)
    return x, face


@inlined
def normalise(n: Vector) -> None:
    """Make a vector one of length 1."""
    length = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
    if length < TINY:
        n[0], n[1], n[2] = 1.0, 0.0, 0.0
        return
    scale = 1.0 / length
    n[0], n[1], n[2] = n[0] * scale, n[1] * scale, n[2] * scale


@inlined
def solid_normal(
    kind: int, size: Vector, p: Vector, r: Vector, x: float, face: int, n: Vector
) -> None:
    """Fill ``n`` with the normal of a capsule, cylinder or box where a ray meets that face at distance x."""
    if kind == BOX:
        n[0], n[1], n[2] = 0.0, 0.0, 0.0
        n[abs(face) - 1] = 1.0 if face > 0 else -1.0
    elif kind == CYLINDER and face != 0:
        n[0], n[1], n[2] = 0.0, 0.0, float(face)
    else:
        n[0], n[1] = p[0] + r[0] * x, p[1] + r[1] * x
        n[2] = 0.0 if face == 0 else p[2] + r[2] * x - size[1] * face
        normalise(n)
