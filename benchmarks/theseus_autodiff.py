# SPDX-License-Identifier: MIT
"""The same problem in Theseus as its tutorials write it: error functions, autodiff and a TheseusLayer.

``stacked`` puts all pads into one tactile and one penetration cost; without it each pad has its own two, which the
layer vectorises where pads have equally many points.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import theseus as th
import torch

from .problem import Problem
from .theseus_common import Frames, Weights, as_matrices, linearised, optimizer_options


class AutodiffSolver:
    """Solves batches of a problem's frames.

    Args:
        problem: The problem.
        dtype: "float32" or "float64".
        device: "cpu" or "cuda".
        stacked: Whether all pads share two costs.
    """

    def __init__(
        self, problem: Problem, dtype: str = "float32", device: str = "cpu", stacked: bool = True
    ) -> None:
        self.frames = Frames(problem, getattr(torch, dtype), device)
        self.field = Field(problem, self.frames.dtype, device)
        begins, ends = problem.offsets[:-1], problem.offsets[1:]
        self.points_p = [
            torch.as_tensor(problem.points_p[a:b].T.copy(), dtype=self.frames.dtype, device=device)
            for a, b in zip(begins, ends, strict=True)
        ]
        every = list(range(problem.pads))
        self.groups = [every] if stacked else [[k] for k in every]
        objective = th.Objective(dtype=self.frames.dtype)
        for cost in self._costs(problem):
            objective.add(cost)
        optimizer = th.LevenbergMarquardt(objective, vectorize=True, **optimizer_options(problem))
        self.layer = th.TheseusLayer(optimizer, vectorize=True).to(device)

    def _costs(self, problem: Problem) -> list[Any]:
        weights = Weights(problem, self.frames.dtype)
        pose, visual = weights.identity("pose"), weights.identity("visual")
        seen = th.Difference(pose, visual, weights.visual, name="visual_cost")
        costs = [weights.robust(seen, problem.log_theta_vis, flatten=False)]
        theta = th.Variable(
            torch.tensor([[problem.log_theta_tac]], dtype=self.frames.dtype), name="log_theta_tac"
        )
        for n, pads in enumerate(self.groups):
            sizes = [self.points_p[k].shape[1] for k in pads]
            points = th.Variable(
                torch.zeros(1, 3, sum(sizes), dtype=self.frames.dtype), name=f"points_{n}"
            )
            touching = th.Variable(
                torch.zeros(1, len(pads), dtype=self.frames.dtype), name=f"touching_{n}"
            )
            tactile = th.AutoDiffCostFunction(
                [pose],
                self.field.tactile(sizes),
                len(pads),
                weights.tactile,
                aux_vars=[points, touching],
                name=f"tactile_{n}",
            )
            costs.append(
                th.RobustCostFunction(
                    tactile, th.WelschLoss, theta, flatten_dims=True, name=f"tactile_{n}_robust"
                )
            )
            costs.append(
                th.AutoDiffCostFunction(
                    [pose],
                    self.field.penetration(sizes),
                    len(pads),
                    weights.penetration,
                    aux_vars=[points],
                    name=f"penetration_{n}",
                )
            )
        return costs

    def inputs(self, frames: slice, T_start: np.ndarray) -> dict[str, torch.Tensor]:
        """These frames and their starts (B, 4, 4) as tensors."""
        return self.frames.inputs(frames, T_start) | {"contacts": self.frames.contacts[frames]}

    def solve(self, inputs: dict[str, torch.Tensor]) -> np.ndarray:
        """Object poses (B, 4, 4)."""
        with torch.no_grad(), th.no_lie_group_check(silent=True):
            values, _ = self.layer.forward(
                self._named(inputs), optimizer_kwargs={"damping": self.frames.damping}
            )
            return as_matrices(values["pose"])

    def linearise(self, inputs: dict[str, torch.Tensor]) -> dict[str, np.ndarray]:
        """Cost (B,), J'J (B, 6, 6) and -J'r (B, 6), rotation first, at the frames' starts."""
        with torch.no_grad(), th.no_lie_group_check(silent=True):
            self.layer.objective.update(self._named(inputs))
            return linearised(self.layer.objective, self.layer.optimizer)

    def _named(self, inputs: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
        named = {"pose": inputs["pose"], "visual": inputs["visual"]}
        T_wp = inputs["T_wp"]
        for n, pads in enumerate(self.groups):
            moved = [T_wp[:, k, :, :3] @ self.points_p[k] + T_wp[:, k, :, 3:] for k in pads]
            named[f"points_{n}"] = torch.cat(moved, dim=2)
            named[f"touching_{n}"] = inputs["contacts"][:, pads]
        return named


class Field:
    """The object's distance field and the pads' error functions over it."""

    def __init__(self, problem: Problem, dtype: torch.dtype, device: str) -> None:
        def constant(array: np.ndarray) -> torch.Tensor:
            return torch.as_tensor(np.array(array), dtype=dtype, device=device)

        self.lower, self.upper = constant(problem.lower), constant(problem.upper)
        self.volume = constant(problem.values)[None, None]
        # One function object a shape, so that Theseus can tell which costs are alike.
        self._functions: dict[Any, Any] = {}

    def tactile(self, sizes: list[int]) -> Any:
        """Error function max(0, phi) of the touching pads, which have so many points each."""

        def error(optim_vars: Any, aux_vars: Any) -> torch.Tensor:
            points, touching = aux_vars
            return self.least(optim_vars[0], points.tensor, sizes).relu() * touching.tensor

        return self._functions.setdefault(("tactile", *sizes), error)

    def penetration(self, sizes: list[int]) -> Any:
        """Error function min(0, phi) of pads which have so many points each."""

        def error(optim_vars: Any, aux_vars: Any) -> torch.Tensor:
            return -(-self.least(optim_vars[0], aux_vars[0].tensor, sizes)).relu()

        return self._functions.setdefault(("penetration", *sizes), error)

    def least(self, pose: th.SE3, points_w: torch.Tensor, sizes: list[int]) -> torch.Tensor:
        """Each pad's least distance (B, K), given all pads' points (B, 3, P)."""
        R, t = pose.tensor[:, :, :3], pose.tensor[:, :, 3:]
        points_o = (R.mT @ (points_w - t)).mT  # (B, P, 3)
        inside = torch.minimum(torch.maximum(points_o, self.lower), self.upper)
        unit = 2 * (inside - self.lower) / (self.upper - self.lower) - 1
        phi = torch.nn.functional.grid_sample(
            self.volume, unit.flip(2)[None, None], align_corners=True, padding_mode="border"
        ).view(points_o.shape[:2])
        phi = phi + (points_o - inside).norm(dim=2)
        return torch.stack([part.amin(dim=1) for part in phi.split(sizes, dim=1)], dim=1)
