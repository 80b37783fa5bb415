# SPDX-License-Identifier: MIT
"""Where a ray meets a triangle, and the normal there; formulas and frames as in ``solids``."""

from __future__ import annotations

from ..compiled import inlined
from .solids import TINY, Vector, normalise

BESIDE = 1e-10  # a ray so far beside an edge, as a share of what it is compared with, is looked at exactly


@inlined
def cross(a: Vector, b: Vector, c: Vector) -> None:
    """Fill ``c`` with a x b."""
    c[0] = a[1] * b[2] - a[2] * b[1]
    c[1] = a[2] * b[0] - a[0] * b[2]
    c[2] = a[0] * b[1] - a[1] * b[0]


@inlined
def dot(a: Vector, b: Vector) -> float:
    """The scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]  # type: ignore[no-any-return]


@inlined
def plane_of_ray(r: Vector, b0: Vector, b1: Vector) -> None:
    """Fill ``b0`` and ``b1`` with MuJoCo's two vectors of length 1 that are square to a ray."""
    b0[0], b0[1], b0[2] = 1.0, 1.0, 1.0
    if abs(r[0]) >= abs(r[1]) and abs(r[0]) >= abs(r[2]):
        b0[0] = 0.0
    elif abs(r[1]) >= abs(r[2]):
        b0[1] = 0.0
    else:
        b0[2] = 0.0
    along = -dot(r, b0) / dot(r, r)
    for i in range(3):
        b1[i] = b0[i] + r[i] * along
    normalise(b1)
    cross(b1, r, b0)
    normalise(b0)


@inlined
def inside(v: Vector, p: Vector, b0: Vector, b1: Vector) -> bool:
    """Whether a ray from ``p``, square to ``b0`` and ``b1``, passes between a triangle's corners (3, 3)."""
    x0 = b0[0] * (v[0, 0] - p[0]) + b0[1] * (v[0, 1] - p[1]) + b0[2] * (v[0, 2] - p[2])
    y0 = b1[0] * (v[0, 0] - p[0]) + b1[1] * (v[0, 1] - p[1]) + b1[2] * (v[0, 2] - p[2])
    x1 = b0[0] * (v[1, 0] - p[0]) + b0[1] * (v[1, 1] - p[1]) + b0[2] * (v[1, 2] - p[2])
    y1 = b1[0] * (v[1, 0] - p[0]) + b1[1] * (v[1, 1] - p[1]) + b1[2] * (v[1, 2] - p[2])
    x2 = b0[0] * (v[2, 0] - p[0]) + b0[1] * (v[2, 1] - p[1]) + b0[2] * (v[2, 2] - p[2])
    y2 = b1[0] * (v[2, 0] - p[0]) + b1[1] * (v[2, 1] - p[1]) + b1[2] * (v[2, 2] - p[2])
    a00, a01, a10, a11 = x0 - x2, x1 - x2, y0 - y2, y1 - y2
    determinant = a00 * a11 - a01 * a10
    if abs(determinant) < TINY:
        return False
    s = (a11 * -x2 - a01 * -y2) / determinant
    t = (-a10 * -x2 + a00 * -y2) / determinant
    return s >= 0.0 and t >= 0.0 and s + t <= 1.0  # type: ignore[no-any-return]


@inlined
def meet_plane(v: Vector, p: Vector, r: Vector, a: Vector, b: Vector, n: Vector) -> float:
    """Distance to a triangle's plane, whose normal, of any length, ``n`` becomes; ``a`` and ``b`` are scratch."""
    for i in range(3):
        a[i], b[i] = v[0, i] - v[2, i], v[1, i] - v[2, i]
    cross(a, b, n)
    slope = dot(r, n)
    if abs(slope) < TINY:
        return -1.0
    for i in range(3):
        a[i] = p[i] - v[2, i]
    return -dot(a, n) / slope
