# SPDX-License-Identifier: MIT
"""The one way this package makes a ``gtsam.CustomFactor``: checked, since GTSAM does not check.

GTSAM 4.3 calls the Python callback and trusts what it leaves behind. A Jacobian not set, one-dimensional or
with too few rows ends the process with a segmentation fault; wrong columns, NaN in the residual and a zero
sigma make the optimiser return its start without a word. Each of these raises a ``FactorError`` here.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import gtsam
import numpy as np

from ..exceptions import FactorError

POSE3_DIMENSION = 6

ErrorFunction = Callable[[gtsam.CustomFactor, gtsam.Values, "list[Any] | None"], np.ndarray]


def checked_factor(
    noise: gtsam.noiseModel.Base,
    keys: Sequence[int],
    error: ErrorFunction,
    dimensions: Sequence[int] | None = None,
) -> gtsam.CustomFactor:
    """A factor whose callback is held to GTSAM's contract at every evaluation.

    Args:
        noise: Noise model; its dimension is the residual's. Sigmas must be finite and positive.
        keys: Keys of the variables.
        error: GTSAM's own callback, ``error(factor, values, jacobians)``: returns the residual and, where
            ``jacobians`` is not None, assigns ``jacobians[i] = J`` of shape (rows, dimension of variable i).
        dimensions: Dimension of each variable's tangent space; 6 (``Pose3``) where not given.

    Raises:
        FactorError: The noise model is unusable; later, out of the optimiser, whenever the callback breaks the
            contract. What the callback itself raises passes through unchanged.
    """
    rows = noise.dim()
    columns = [POSE3_DIMENSION] * len(keys) if dimensions is None else list(dimensions)
    if len(columns) != len(keys):
        raise FactorError(f"expected a dimension for each of {len(keys)} keys, got {len(columns)}")
    _check_sigmas(noise)

    def checked(
        factor: gtsam.CustomFactor, values: gtsam.Values, jacobians: list[np.ndarray] | None
    ) -> np.ndarray:
        if jacobians is None:
            return _checked_residual(error(factor, values, None), rows)
        filled = _Jacobians([None] * len(keys))
        residual = _checked_residual(error(factor, values, filled), rows)
        for index, jacobian in enumerate(list.__iter__(filled)):
            jacobians[index] = _checked_jacobian(jacobian, rows, columns[index], index)
        return residual

    return gtsam.CustomFactor(noise, list(keys), checked)


class _Jacobians(list[Any]):
    """The list a callback fills; GTSAM's own cannot be written in place, and says so badly."""

    def __getitem__(self, index: Any) -> Any:
        jacobian = super().__getitem__(index)
        if jacobian is None:
            raise FactorError(
                f"the callback must assign jacobians[{index}] = J; "
                f"there is nothing yet to write into with jacobians[{index}][...] = J"
            )
        return jacobian


def _check_sigmas(noise: gtsam.noiseModel.Base) -> None:
    gaussian = noise.noise() if isinstance(noise, gtsam.noiseModel.Robust) else noise
    sigmas = gaussian.sigmas()
    if not (np.isfinite(sigmas).all() and (sigmas > 0).all()):
        raise FactorError(f"the noise model's sigmas must be finite and positive, got {sigmas}")


def _checked_residual(returned: Any, rows: int) -> np.ndarray:
    residual: np.ndarray = np.asarray(returned, dtype=np.float64)
    if residual.shape != (rows,):
        raise FactorError(
            f"the callback must return a residual of shape ({rows},), the noise model's dimension, "
            f"got shape {residual.shape}"
        )
    if not (math.isfinite(residual.dot(residual)) or np.isfinite(residual).all()):
        raise FactorError(f"the callback returned a residual that is not finite: {residual}")
    return residual


def _checked_jacobian(assigned: Any, rows: int, columns: int, index: int) -> np.ndarray:
    if assigned is None:
        raise FactorError(
            f"the callback left jacobians[{index}] unset; assign jacobians[{index}] = J"
        )
    jacobian: np.ndarray = np.asarray(assigned, dtype=np.float64)
    if jacobian.shape != (rows, columns):
        raise FactorError(
            f"jacobians[{index}] must have shape ({rows}, {columns}), got {jacobian.shape}"
        )
    flat = jacobian.ravel()
    if not (math.isfinite(flat.dot(flat)) or np.isfinite(jacobian).all()):
        raise FactorError(f"jacobians[{index}] is not finite:\n{jacobian}")
    return jacobian
