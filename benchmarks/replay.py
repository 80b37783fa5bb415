# SPDX-License-Identifier: MIT
"""What GTSAM's optimiser costs by itself: a frame's optimisation with callbacks that have nothing to compute."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gtsam
import numpy as np

from vtgtsam import EstimatorConfig
from vtgtsam.frame import Frame
from vtgtsam.objective import Objective
from vtgtsam.solvers import gtsam_optimizers
from vtgtsam.solvers.graph import OBJECT, GraphBuilder


class Replay:
    """A frame's optimisation with callbacks that hand out what they computed once, in the same order.

    Args:
        objective: The frame's terms.
        frame: The frame, which has a visual pose.
        T_start: Where the optimiser begins, (4, 4).
        config: Settings.
    """

    def __init__(
        self, objective: Objective, frame: Frame, T_start: np.ndarray, config: EstimatorConfig
    ) -> None:
        self._T_start, self._config = T_start, config
        self._answers: list[tuple[np.ndarray, np.ndarray]] = []
        self._next = 0
        objective.place(frame)
        terms, graph = objective.hand, GraphBuilder(objective.hand, config).build(frame)
        self._visual, hand = graph.at(0), graph.at(1)
        self._noise = gtsam.noiseModel.Unit.Create(len(terms.rows))

        def record(factor: Any, values: gtsam.Values, jacobians: list[Any] | None) -> np.ndarray:
            hand.error(values)
            rows = terms.losses if jacobians is None else terms.rows
            self._answers.append((rows.copy(), terms.jacobians.copy()))
            return self._give(self._answers[-1], jacobians)

        self._optimise(record)

    def solve(self) -> None:
        """Optimise once more."""
        self._next = 0
        self._optimise(self._replay)

    def _replay(self, factor: Any, values: Any, jacobians: list[Any] | None) -> np.ndarray:
        self._next += 1
        return self._give(self._answers[self._next - 1], jacobians)

    @staticmethod
    def _give(answer: tuple[np.ndarray, np.ndarray], jacobians: list[Any] | None) -> np.ndarray:
        if jacobians is not None:
            jacobians[0] = answer[1]
        return answer[0]

    def _optimise(self, error: Callable[..., np.ndarray]) -> None:
        graph = gtsam.NonlinearFactorGraph()
        graph.push_back(self._visual)
        graph.push_back(gtsam.CustomFactor(self._noise, [OBJECT], error))
        gtsam_optimizers.solve(graph, OBJECT, self._T_start, self._config)
