# SPDX-License-Identifier: MIT
"""What a method makes of the pads: how far they are from its object, how much their contacts count."""

from __future__ import annotations

from typing import TYPE_CHECKING

import gtsam
import numpy as np

from ..factors.noise import welsch_weight
from ..sdf.search import ClosestPoints

if TYPE_CHECKING:
    from ..config import EstimatorConfig
    from ..hands.pads import PadSet
    from ..objects import ObjectModel


class PadJudge:
    """Pads' distances and weights at a method's poses, as its ``Estimate`` has them.

    Args:
        hand: The hand.
        obj: The object.
        config: The method's settings; None where they are not known: each contact counts in full.
    """

    def __init__(self, hand: PadSet, obj: ObjectModel, config: EstimatorConfig | None) -> None:
        self._closest = ClosestPoints(hand, obj.sdf)
        self._config = config

    def distances(self, T_wp: np.ndarray, T_wo: gtsam.Pose3) -> np.ndarray:
        """Signed distances of pads at T_wp (K, 4, 4) to the object [m], shape (K,)."""
        every = np.ones(len(T_wp), dtype=bool)
        matrix = np.ascontiguousarray(T_wo.matrix())  # GTSAM's are in Fortran order
        return self._closest.search(matrix, np.ascontiguousarray(T_wp), every).distances

    def weights(self, distances: np.ndarray) -> np.ndarray:
        """How much a contact of each pad counts after its robust loss, in [0, 1], shape (K,)."""
        config = self._config
        if config is None or "tac" not in config.method:
            return np.ones(len(distances))
        gaps = np.maximum(distances, 0.0)
        return welsch_weight(config.w_tac * gaps**2, config.log_theta_tac)
