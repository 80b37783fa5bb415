# SPDX-License-Identifier: MIT
"""vtgtsam's estimator as a benchmark solver."""

from __future__ import annotations

from typing import Any

import gtsam
import numpy as np
from gtsam.symbol_shorthand import X

from vtgtsam import EstimatorConfig, GridSdf, Measurement, ObjectModel, Pad, PadSet, PoseEstimator
from vtgtsam.graph import build_graph
from vtgtsam.sdf.search import ClosestPoints

from .clock import timed
from .problem import Problem
from .solver import Linearised, Solved


class Ours:
    """Solves a problem's frames one by one.

    Args:
        problem: The problem.
        solver: "lm" or "fixed-damping".
        obj: The problem's object; made from its grid where not given.
    """

    def __init__(
        self,
        problem: Problem,
        solver: str = "lm",
        obj: ObjectModel | None = None,
    ) -> None:
        self.name = f"vtgtsam {solver}"
        if obj is None:
            field = GridSdf(problem.values, problem.lower, problem.upper)
            obj = ObjectModel("object", field)
        self.estimator = PoseEstimator(pad_set(problem), obj, config(problem, solver=solver))
        self.measurements = measurements(problem)
        self.closest = ClosestPoints(self.estimator.hand, obj.sdf)

    def solve(self, frame: int, T_start: np.ndarray, batch: int = 1) -> Solved:
        """Solve frames [frame, frame + batch); only ``batch`` 1, since a frame is an update."""
        if batch != 1:
            raise ValueError(f"vtgtsam solves one frame at a time, got a batch of {batch}")
        self.estimator.reset(gtsam.Pose3(T_start[0]))
        time, estimate = timed(lambda: self.estimator.update(self.measurements[frame]))
        assert estimate.T_wo is not None  # the frame was given its start
        return Solved(estimate.T_wo.matrix()[None], time)

    def linearise(self, frame: int, T_wo: np.ndarray) -> Linearised:
        """The frame's objective at T_wo (4, 4)."""
        graph = build_graph(self.measurements[frame], self.closest, X(0), self.estimator.config)
        values = gtsam.Values()
        values.insert(X(0), gtsam.Pose3(T_wo))
        return Linearised(graph.error(values), *graph.linearize(values).hessian())

    def close(self) -> None:
        """Nothing to let go of."""


def pad_set(problem: Problem) -> PadSet:
    """The problem's pads; their sizes do not matter, their points do."""
    begin, end = problem.offsets[:-1], problem.offsets[1:]
    return PadSet(
        Pad(f"pad_{k}", np.ptp(points[:, :2], axis=0), points)
        for k, points in enumerate(problem.points_p[a:b] for a, b in zip(begin, end, strict=True))
    )


def config(problem: Problem, **overrides: Any) -> EstimatorConfig:
    """The problem's settings as the estimator's."""
    rotation, translation = (float(w) for w in problem.w_vis)
    settings: dict[str, Any] = {
        "iterations": problem.iterations,
        "damping": problem.damping,
        "log_theta_vis": problem.log_theta_vis,
        "log_theta_tac": problem.log_theta_tac,
        "w_vis": {"rotation": rotation, "translation": translation},
        "w_tac": problem.w_tac,
        "w_pen": problem.w_pen,
    }
    return EstimatorConfig.simulation(**(settings | overrides))


def measurements(problem: Problem) -> list[Measurement]:
    """The problem's frames as measurements."""
    return [
        Measurement(
            time=0.033 * n,
            contacts=problem.contacts[n],
            T_wo_visual=gtsam.Pose3(problem.T_visual[n]),
            T_wp=problem.T_wp[n],
        )
        for n in range(problem.frames)
    ]
