# SPDX-License-Identifier: MIT
"""Vectors of three numbers in compiled loops."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import inlined

Vector = NDArray[np.float64]


@inlined
def dot(a: Vector, b: Vector) -> float:
    """The scalar product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]  # type: ignore[no-any-return]


@inlined
def cross(a: Vector, b: Vector, c: Vector) -> None:
    """Fill ``c`` with a x b."""
    c[0] = a[1] * b[2] - a[2] * b[1]
    c[1] = a[2] * b[0] - a[0] * b[2]
    c[2] = a[0] * b[1] - a[1] * b[0]


@inlined
def into_frame(R: Vector, a: Vector, b: Vector) -> None:
    """Fill ``b`` with R^T a."""
    for i in range(3):
        b[i] = R[0, i] * a[0] + R[1, i] * a[1] + R[2, i] * a[2]


@inlined
def normal_into_world(R: Vector, n: Vector, n_w: Vector) -> None:
    """Fill ``n_w`` with R n, made one of length 1."""
    length = np.sqrt(dot(n, n))
    for i in range(3):
        n_w[i] = dot(R[i], n) / length if length > 0.0 else 0.0
