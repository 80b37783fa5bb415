# SPDX-License-Identifier: MIT
r"""Compiled exponential and logarithm of SE(3), as in GTSAM: twists are [rotation, translation].

With W = skew(omega), t = |omega| and E = T_1^-1 T_2,

    Exp(omega, v) = [ R  V v ],   R = I + a W + b W^2,   V = I + b W + c W^2,   Log its inverse,

    Log(Exp(-xi) E) = r - Jl(r)^-1 xi + O(xi^2),   r = Log(E),

    Jl(r)^-1 = [      A       0 ]      A = Jl(omega)^-1 = I - W / 2 + d W^2,
               [ -A Q(r) A    A ]

with Q from Barfoot, State Estimation for Robotics, eq. (7.86). The coefficients are functions of t^2: power series
where t is small, since the closed forms cancel there.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from .compiled import compiled, inlined

_SMALL = 0.25  # [rad^2], the series of eight terms are exact to double precision up to here


@inlined
def _alternating(squared: float, power: int) -> float:
    """Sum of (-1)^n t^(2n) / (2n + power)! for n up to 7."""
    first = 1.0
    for n in range(2, power + 1):
        first /= n
    term, total = first, first
    for n in range(1, 8):
        term *= -squared / ((2 * n + power - 1) * (2 * n + power))
        total += term
    return total


@inlined
def exp_coefficients(squared: float) -> Any:
    """A = sin t / t, b = (1 - cos t) / t^2, c = (t - sin t) / t^3."""
    if squared < _SMALL:
        return _alternating(squared, 1), _alternating(squared, 2), _alternating(squared, 3)
    t = np.sqrt(squared)
    half = np.sin(0.5 * t)
    return np.sin(t) / t, 2.0 * half * half / squared, (t - np.sin(t)) / (t * squared)


@inlined
def log_coefficient(squared: float) -> float:
    """D = 1 / t^2 - (1 + cos t) / (2 t sin t)."""
    if squared < _SMALL:
        return 1 / 12 + squared * (
            1 / 720
            + squared
            * (
                1 / 30240
                + squared
                * (
                    1 / 1209600
                    + squared
                    * (1 / 47900160 + squared * (691 / 1307674368000 + squared / 74724249600))
                )
            )
        )
    t = np.sqrt(squared)
    return (1.0 - 0.5 * t / np.tan(0.5 * t)) / squared  # type: ignore[no-any-return]


@inlined
def _q_coefficients(squared: float) -> Any:
    """Coefficients of Q: (t - sin t) / t^3, (t^2 + 2 cos t - 2) / 2 t^4, (2 t - 3 sin t + t cos t) / 2 t^5."""
    if squared < _SMALL:
        term, last = 1 / 120, 1 / 120  # (-1)^n (n + 1) t^(2n) / (2n + 5)!
        for n in range(1, 8):
            term *= -squared / ((2 * n + 4) * (2 * n + 5))
            last += (n + 1) * term
        return _alternating(squared, 3), _alternating(squared, 4), last
    t = np.sqrt(squared)
    sine, cosine = np.sin(t), np.cos(t)
    return (
        (t - sine) / (t * squared),
        (squared + 2.0 * cosine - 2.0) / (2.0 * squared * squared),
        (2.0 * t - 3.0 * sine + t * cosine) / (2.0 * squared * squared * t),
    )


@inlined
def _skew(x: float, y: float, z: float, W: Any) -> None:
    """Cross product matrix of (x, y, z) into W (3, 3)."""
    W[0, 0], W[0, 1], W[0, 2] = 0.0, -z, y
    W[1, 0], W[1, 1], W[1, 2] = z, 0.0, -x
    W[2, 0], W[2, 1], W[2, 2] = -y, x, 0.0


@inlined
def _times(A: Any, B: Any, C: Any) -> None:
    """A B into C, all (3, 3)."""
    for i in range(3):
        for j in range(3):
            C[i, j] = A[i, 0] * B[0, j] + A[i, 1] * B[1, j] + A[i, 2] * B[2, j]


@compiled
def retract(T: Any, xi: Any, moved: Any) -> None:
    """T Exp(xi) into ``moved``, poses (4, 4), xi (6,)."""
    W, WW, E = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    squared = xi[0] * xi[0] + xi[1] * xi[1] + xi[2] * xi[2]
    a, b, c = exp_coefficients(squared)
    _skew(xi[0], xi[1], xi[2], W)
    _times(W, W, WW)
    t = np.empty(3)
    for i in range(3):
        t[i] = xi[3 + i]
        for j in range(3):
            E[i, j] = a * W[i, j] + b * WW[i, j] + (i == j)
            t[i] += (b * W[i, j] + c * WW[i, j]) * xi[3 + j]
    for i in range(3):
        for j in range(3):
            moved[i, j] = T[i, 0] * E[0, j] + T[i, 1] * E[1, j] + T[i, 2] * E[2, j]
        moved[i, 3] = T[i, 0] * t[0] + T[i, 1] * t[1] + T[i, 2] * t[2] + T[i, 3]
    moved[3, 0], moved[3, 1], moved[3, 2], moved[3, 3] = 0.0, 0.0, 0.0, 1.0


@compiled
def log_between(T1: Any, T2: Any, r: Any) -> None:
    """Log(T1^-1 T2) into ``r`` (6,), of poses (4, 4)."""
    R, t = np.empty((3, 3)), np.empty(3)
    for i in range(3):
        t[i] = 0.0
        for j in range(3):
            R[i, j] = T1[0, i] * T2[0, j] + T1[1, i] * T2[1, j] + T1[2, i] * T2[2, j]
            t[i] += T1[j, i] * (T2[j, 3] - T1[j, 3])
    _log_rotation(R, r)
    squared = r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
    d = log_coefficient(squared)
    # V^-1 t = t - omega x t / 2 + d omega x (omega x t)
    x, y, z = _cross(r[0], r[1], r[2], t[0], t[1], t[2])
    u, v, w = _cross(r[0], r[1], r[2], x, y, z)
    r[3], r[4], r[5] = t[0] - 0.5 * x + d * u, t[1] - 0.5 * y + d * v, t[2] - 0.5 * z + d * w


@inlined
def _cross(a: float, b: float, c: float, x: float, y: float, z: float) -> Any:
    return b * z - c * y, c * x - a * z, a * y - b * x


@compiled
def _log_rotation(R: Any, r: Any) -> None:
    """Rotation vector of R (3, 3) into r[:3]."""
    x, y, z = (R[2, 1] - R[1, 2]) / 2, (R[0, 2] - R[2, 0]) / 2, (R[1, 0] - R[0, 1]) / 2
    sine, cosine = np.sqrt(x * x + y * y + z * z), (R[0, 0] + R[1, 1] + R[2, 2] - 1) / 2
    angle = np.arctan2(sine, cosine)
    if cosine > -0.9:
        squared = angle * angle
        # t / sin t; its series where both vanish
        scale = angle / sine if sine > 1e-4 else 1 + squared / 6 + 7 * squared * squared / 360
        r[0], r[1], r[2] = scale * x, scale * y, scale * z
        return
    # Half a turn: the sine says little. R + R^T = 2 cos t I + 2 (1 - cos t) a a^T gives the axis a but for its sign.
    most = 0
    for i in range(1, 3):
        if R[i, i] > R[most, most]:
            most = i
    for i in range(3):
        r[i] = (R[i, most] + R[most, i]) / 2 - (i == most) * cosine
    norm = np.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
    sign = 1.0 if r[0] * x + r[1] * y + r[2] * z >= 0 else -1.0
    for i in range(3):
        r[i] *= sign * angle / norm


@compiled
def inverse_left_jacobian(r: Any, J: Any) -> None:
    """Jl(r)^-1 of a twist (6,) into ``J`` (6, 6)."""
    W, V, WW = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    WV, VW, A, Q = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    WVW, M = np.empty((3, 3)), np.empty((3, 3))
    _skew(r[0], r[1], r[2], W)
    _skew(r[3], r[4], r[5], V)
    squared = r[0] * r[0] + r[1] * r[1] + r[2] * r[2]
    d = log_coefficient(squared)
    c1, c2, c3 = _q_coefficients(squared)
    _times(W, W, WW)
    _times(W, V, WV)
    _times(V, W, VW)
    _times(WV, W, WVW)
    for i in range(3):
        for j in range(3):
            A[i, j] = (i == j) - 0.5 * W[i, j] + d * WW[i, j]
            Q[i, j] = 0.5 * V[i, j] + c1 * (WV[i, j] + VW[i, j] + WVW[i, j])
    _times(W, WV, M)
    _add(Q, c2, M)
    _times(VW, W, M)
    _add(Q, c2, M)
    _add(Q, -3 * c2, WVW)
    _times(WVW, W, M)
    _add(Q, c3, M)
    _times(W, WVW, M)
    _add(Q, c3, M)
    _times(A, Q, M)
    _times(M, A, Q)
    for i in range(3):
        for j in range(3):
            J[i, j], J[3 + i, 3 + j] = A[i, j], A[i, j]
            J[i, 3 + j], J[3 + i, j] = 0.0, -Q[i, j]


@inlined
def _add(A: Any, factor: float, B: Any) -> None:
    """Add factor B to A."""
    for i in range(3):
        for j in range(3):
            A[i, j] += factor * B[i, j]
