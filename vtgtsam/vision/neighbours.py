# SPDX-License-Identifier: MIT
"""How many neighbouring pixels err together, from the products of what is left in them (``noise_kernels.products``)."""

from __future__ import annotations

import numpy as np

LAGS = 10  # [pixels], so far apart correlation is looked for
CHANCE = 30.0  # pairs of pixels beside those seen, unrelated: a few agree by chance
UNRELATED = 0.1  # correlation below which two pixels count as independent


def beside(products: np.ndarray, chance: float = CHANCE) -> float:
    """Sum of the correlations with the neighbours to one side, until one is unrelated; 0 where none is related.

    Args:
        products: Products and mean squares of pixels at each lag from 0, shape (LAGS + 1, 2).
        chance: Mean squares of unrelated pairs beside them.
    """
    rho = products[1:, 0] / (products[1:, 1] + chance)
    related = np.cumprod(rho > UNRELATED).astype(bool)
    return float(rho[related].sum())
