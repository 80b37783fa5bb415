# SPDX-License-Identifier: MIT
"""Checks a factor's Jacobian against central differences."""

import gtsam
import numpy as np


def assert_jacobian_matches(factor, values, step=1e-6, atol=1e-6):
    """Compare the linearized factor with central differences of its whitened error."""

    def error_at(key, xi):
        delta = gtsam.VectorValues()
        delta.insert(key, xi)
        return factor.whitenedError(values.retract(delta))

    zero = values.zeroVectors()
    expected = np.column_stack(
        [
            (error_at(key, step * e_i) - error_at(key, -step * e_i)) / (2 * step)
            for key in factor.keys()
            for e_i in np.eye(zero.dim(key))
        ]
    )
    actual, _ = factor.linearize(values).jacobian()
    np.testing.assert_allclose(actual, expected, atol=atol)
