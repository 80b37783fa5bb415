# SPDX-License-Identifier: MIT
import numpy as np
import pytest

from vtgtsam.cholesky import factorize, invert, solve


def positive(seed, size=6):
    J = np.random.default_rng(seed).normal(size=(size + 2, size))
    return J.T @ J


@pytest.mark.parametrize("seed", range(5))
def test_it_is_numpys_decomposition(seed):
    A, L, M, x = positive(seed), np.zeros((6, 6)), np.zeros((6, 6)), np.empty(6)
    assert factorize(A, 0.5, L)
    np.testing.assert_allclose(L, np.linalg.cholesky(A + 0.5 * np.eye(6)), atol=1e-12)
    invert(L, M)
    np.testing.assert_allclose(M @ L, np.eye(6), atol=1e-12)
    assert solve(L, np.arange(6.0), x)
    np.testing.assert_allclose((A + 0.5 * np.eye(6)) @ x, np.arange(6.0), atol=1e-11)


@pytest.mark.parametrize(
    "A", [np.zeros((6, 6)), -np.eye(6), np.full((6, 6), np.nan), np.diag(np.full(6, np.inf))]
)
def test_what_is_not_positive_definite_is_refused(A):
    assert not factorize(A, 0.0, np.empty((6, 6)))


def test_a_solution_that_overflows_is_told():
    L = np.zeros((6, 6))
    assert factorize(1e-300 * np.eye(6), 0.0, L)
    assert not solve(L, np.full(6, 1e100), np.empty(6))
