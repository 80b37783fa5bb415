# SPDX-License-Identifier: MIT
r"""Weights and robust losses as GTSAM's noise models.

A term of the cost (paper, eq. 4) is 1/2 rho(w ||r||^2) with Welsch's rho(e) = theta - theta exp(-e / theta).
GTSAM whitens with sigma = 1 / sqrt(w) and its Welsch loss is c^2 / 2 (1 - exp(-(e / c)^2)) of the whitened
norm e: the same with c = sqrt(theta) = exp(log(theta) / 2).

Noise models are values, and frames share most of theirs: they are made once.
"""

from __future__ import annotations

import math
from functools import cache, lru_cache

import gtsam
import numpy as np
from gtsam import noiseModel

_Scheme = noiseModel.mEstimator.Base.ReweightScheme


@cache
def pose_noise(rotation_weight: float, translation_weight: float) -> gtsam.noiseModel.Base:
    """Gaussian noise on a pose's tangent vector, rotation [1/rad^2] first, translation [1/m^2] after."""
    sigmas = np.repeat([1.0 / math.sqrt(rotation_weight), 1.0 / math.sqrt(translation_weight)], 3)
    return noiseModel.Diagonal.Sigmas(sigmas)


@cache
def distance_noise(count: int, weight: float) -> gtsam.noiseModel.Base:
    """The same Gaussian noise on each of ``count`` distances, weight [1/m^2]."""
    return noiseModel.Isotropic.Sigma(count, 1.0 / math.sqrt(weight))


@lru_cache(maxsize=256)
def welsch_of_norm(noise: gtsam.noiseModel.Base, log_theta: float) -> gtsam.noiseModel.Robust:
    """One Welsch loss on the norm of the whole whitened residual."""
    return noiseModel.Robust.Create(_welsch(log_theta, _Scheme.Block), noise)


@lru_cache(maxsize=256)
def welsch_of_rows(noise: gtsam.noiseModel.Base, log_theta: float) -> gtsam.noiseModel.Robust:
    """A Welsch loss on each row of the whitened residual by itself."""
    return noiseModel.Robust.Create(_welsch(log_theta, _Scheme.Scalar), noise)


def welsch_weight(squared_norm: np.ndarray | float, log_theta: float) -> np.ndarray:
    """How much a whitened residual still counts, in [0, 1]: rho'(e) = exp(-e / theta)."""
    weight: np.ndarray = np.exp(-squared_norm / math.exp(log_theta))
    return weight


@cache
def _welsch(log_theta: float, scheme: _Scheme) -> noiseModel.mEstimator.Welsch:
    return noiseModel.mEstimator.Welsch.Create(math.exp(log_theta / 2), scheme)
