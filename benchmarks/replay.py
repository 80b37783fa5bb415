# SPDX-License-Identifier: MIT
"""What GTSAM's optimiser costs by itself: a frame's optimisation with callbacks that have nothing to compute."""

from __future__ import annotations

from typing import Any

import gtsam
import numpy as np

from vtgtsam import EstimatorConfig
from vtgtsam.estimator import OBJECT
from vtgtsam.factors.penetration import penetration_factor
from vtgtsam.factors.tactile import tactile_factor
from vtgtsam.graph import FrameFactors
from vtgtsam.optimize import optimize


class Replay:
    """A frame's optimisation with callbacks that hand out what they computed once, in the same order.

    Args:
        factors: The frame's factors, all three of them.
        start: Where the optimiser begins.
        config: Settings.
    """

    def __init__(self, factors: FrameFactors, start: gtsam.Values, config: EstimatorConfig) -> None:
        self._start, self._config = start, config
        self.answers = [_Answers(factors, "tactile"), _Answers(factors, "penetration")]
        self._graph = gtsam.NonlinearFactorGraph()
        self._graph.push_back(factors.visual)
        for answers in self.answers:
            self._graph.push_back(answers.factor)
        self.solve()
        for answers in self.answers:
            answers.recorded = True

    def solve(self) -> None:
        """Optimise once more."""
        for answers in self.answers:
            answers.given = 0
        optimize(self._graph, self._start, self._config)


class _Answers:
    """One factor's residuals and Jacobians, in the order in which they were asked for."""

    def __init__(self, factors: FrameFactors, kind: str) -> None:
        made = {"tactile": tactile_factor, "penetration": penetration_factor}[kind]
        robust = getattr(factors, kind)
        self._plain = made(
            OBJECT, factors.pads, gtsam.noiseModel.Unit.Create(robust.noiseModel().dim())
        )
        self.factor = gtsam.CustomFactor(robust.noiseModel(), [OBJECT], self._error)
        self.all: list[tuple[np.ndarray, np.ndarray]] = []
        self.recorded = False
        self.given = 0

    def _error(self, factor: Any, values: gtsam.Values, jacobians: list[Any] | None) -> np.ndarray:
        if not self.recorded:
            jacobian, right_hand_side = self._plain.linearize(values).jacobian()
            self.all.append((-right_hand_side, jacobian))
        residual, jacobian = self.all[self.given]
        self.given += 1
        if jacobians is not None:
            jacobians[0] = jacobian
        return residual
