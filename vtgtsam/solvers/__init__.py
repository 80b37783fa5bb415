# SPDX-License-Identifier: MIT
"""Two ways to take the same steps: compiled, and by GTSAM's own optimisers over the frame's factor graph."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from . import gtsam_optimizers, steps
from .graph import OBJECT, GraphBuilder
from .solution import Solution as Solution

if TYPE_CHECKING:
    from ..config import EstimatorConfig
    from ..frame import Frame
    from ..objective import Objective

Solve = Callable[["Frame", np.ndarray], Solution]


def new_solver(objective: Objective, config: EstimatorConfig) -> Solve:
    """A function that minimises a frame's cost from a pose (4, 4) on; ``objective`` must be placed at the frame."""
    if config.engine == "compiled":
        return lambda frame, T_wo: steps.solve(objective, T_wo, config)
    graphs = GraphBuilder(objective.hand, config)
    return lambda frame, T_wo: gtsam_optimizers.solve(graphs.build(frame), OBJECT, T_wo, config)
