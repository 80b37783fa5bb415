# SPDX-License-Identifier: MIT
"""The only place where this package makes a ``gtsam.CustomFactor``: checked, since GTSAM does not check.

GTSAM 4.3 calls the Python callback and trusts what it leaves behind. A Jacobian not set, one-dimensional or
with too few rows ends the process with a segmentation fault; wrong columns, NaN in the residual and a zero
sigma make the optimiser return its start without a word. Each of these raises a ``FactorError`` here.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from math import isfinite
from typing import cast

import gtsam
import numpy as np

from ..exceptions import FactorError

POSE3_DIMENSION = 6

ErrorFunction = Callable[[gtsam.CustomFactor, gtsam.Values, "list[np.ndarray] | None"], np.ndarray]


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

    shape, shapes = (rows,), [(rows, count) for count in columns]
    filled, empty = _Jacobians(), [None] * len(keys)

    def checked(
        factor: gtsam.CustomFactor, values: gtsam.Values, jacobians: list[np.ndarray] | None
    ) -> np.ndarray:
        if jacobians is None:
            return _residual(error(factor, values, None), shape)
        filled[:] = empty
        residual = _residual(error(factor, values, cast("list[np.ndarray]", filled)), shape)
        for index, expected in enumerate(shapes):
            jacobians[index] = _jacobian(filled.assigned(index), expected, index)
        return residual

    return gtsam.CustomFactor(noise, list(keys), checked)


class _Jacobians(list["np.ndarray | None"]):
    """The list a callback fills; GTSAM's own cannot be written in place, and says so badly."""

    def assigned(self, index: int) -> np.ndarray | None:
        """What the callback has assigned, if anything."""
        return super().__getitem__(index)

    def __getitem__(self, index: int) -> np.ndarray:  # type: ignore[override]
        jacobian = super().__getitem__(index)
        if jacobian is None:
            raise FactorError(
                f"the callback must assign jacobians[{index}] = J; "
                f"there is nothing yet to write into with jacobians[{index}][...] = J"
            )
        return jacobian


@lru_cache(maxsize=256)  # frames share most of their noise models
def _check_sigmas(noise: gtsam.noiseModel.Base) -> None:
    gaussian = noise.noise() if isinstance(noise, gtsam.noiseModel.Robust) else noise
    sigmas = gaussian.sigmas()
    if not (sigmas.min() > 0.0 and sigmas.max() < np.inf):
        raise FactorError(f"the noise model's sigmas must be finite and positive, got {sigmas}")


def _residual(returned: object, shape: tuple[int]) -> np.ndarray:
    if type(returned) is np.ndarray and returned.shape == shape:
        residual = returned
    else:
        residual = np.asarray(returned, dtype=np.float64)
        if residual.shape != shape:
            raise FactorError(
                f"the callback must return a residual of shape {shape}, the noise model's dimension, "
                f"got shape {residual.shape}"
            )
    if not (isfinite(residual.dot(residual)) or np.isfinite(residual).all()):
        raise FactorError(f"the callback returned a residual that is not finite: {residual}")
    return residual


def _jacobian(assigned: np.ndarray | None, shape: tuple[int, int], index: int) -> np.ndarray:
    if assigned is None:
        raise FactorError(
            f"the callback left jacobians[{index}] unset; assign jacobians[{index}] = J"
        )
    jacobian: np.ndarray = np.asarray(assigned)
    if jacobian.shape != shape:
        raise FactorError(f"jacobians[{index}] must have shape {shape}, got {jacobian.shape}")
    flat = jacobian.ravel()
    if not (isfinite(flat.dot(flat)) or np.isfinite(jacobian).all()):
        raise FactorError(f"jacobians[{index}] is not finite:\n{jacobian}")
    return jacobian
