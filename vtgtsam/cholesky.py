# SPDX-License-Identifier: MIT
"""Cholesky's decomposition of small matrices, compiled: a call of LAPACK takes longer than six rows do."""

from __future__ import annotations

from typing import Any

import numpy as np

from .compiled import compiled


@compiled
def factorize(A: Any, damping: float, L: Any) -> bool:
    """Lower L with L L' = A + damping I, all (n, n); whether there is one, that is whether it is positive definite."""
    for i in range(len(A)):
        for j in range(i + 1):
            rest = A[i, j] + damping * (i == j)
            for k in range(j):
                rest -= L[i, k] * L[j, k]
            if i != j:
                L[i, j] = rest / L[j, j]
            elif 0.0 < rest < np.inf:
                L[i, i] = np.sqrt(rest)
            else:
                return False
    return True


@compiled
def solve(L: Any, b: Any, x: Any) -> bool:
    """Solve L L' x = b, with x and b (n,); whether the solution is finite."""
    size, finite = len(b), True
    for i in range(size):
        x[i] = b[i]
        for k in range(i):
            x[i] -= L[i, k] * x[k]
        x[i] /= L[i, i]
    for i in range(size - 1, -1, -1):
        for k in range(i + 1, size):
            x[i] -= L[k, i] * x[k]
        x[i] /= L[i, i]
        finite &= np.isfinite(x[i])
    return finite


@compiled
def invert(L: Any, M: Any) -> None:
    """The inverse of lower L into the lower part of M, both (n, n)."""
    for i in range(len(L)):
        M[i, i] = 1.0 / L[i, i]
        for j in range(i):
            total = 0.0
            for k in range(j, i):
                total += L[i, k] * M[k, j]
            M[i, j] = -total / L[i, i]
