# SPDX-License-Identifier: MIT
"""What the Theseus variants share: frames as tensors, weights and losses, the optimiser's settings."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import theseus as th
import torch

from .problem import Problem

ROTATION_FIRST = [3, 4, 5, 0, 1, 2]  # Theseus' tangent vectors have translation first


class Frames:
    """A problem's frames as tensors, made once, as a caller who works in PyTorch would have them."""

    def __init__(self, problem: Problem, dtype: torch.dtype, device: str) -> None:
        self.dtype, self.device = dtype, device
        self.T_wp = self._tensor(problem.T_wp[:, :, :3])
        self.T_visual = self._tensor(problem.T_visual[:, :3])
        self.contacts = self._tensor(problem.contacts)
        # As a plain float it would be rounded to single precision inside Theseus, whatever the problem's.
        self.damping = torch.tensor(problem.damping, dtype=dtype, device=device)

    def inputs(self, frames: slice, T_start: np.ndarray) -> dict[str, torch.Tensor]:
        """These frames and their starts (B, 4, 4)."""
        return {
            "pose": self._tensor(T_start[:, :3]),
            "visual": self.T_visual[frames],
            "T_wp": self.T_wp[frames],
        }

    def _tensor(self, array: np.ndarray) -> torch.Tensor:
        return torch.as_tensor(np.ascontiguousarray(array), dtype=self.dtype, device=self.device)


class Weights:
    """Weights and losses of a problem; Theseus' weights scale residuals, so they are square roots."""

    def __init__(self, problem: Problem, dtype: torch.dtype) -> None:
        self.dtype = dtype
        rotation, translation = (math.sqrt(w) for w in problem.w_vis)
        diagonal = self._tensor([[translation] * 3 + [rotation] * 3])
        self.visual = th.DiagonalCostWeight(th.Variable(diagonal, name="w_vis"))
        self.tactile = self._scale(problem.w_tac, "w_tac")
        self.penetration = self._scale(problem.w_pen, "w_pen")

    def identity(self, name: str) -> th.SE3:
        """A pose variable."""
        return th.SE3(tensor=torch.eye(3, 4, dtype=self.dtype)[None], name=name)

    def robust(self, cost: th.CostFunction, log_theta: float, flatten: bool) -> Any:
        """The cost under Welsch's loss: one loss a row where ``flatten``, else one for all rows."""
        radius = th.Variable(self._tensor([[log_theta]]), name=f"{cost.name}_log_theta")
        return th.RobustCostFunction(
            cost, th.WelschLoss, radius, flatten_dims=flatten, name=f"{cost.name}_robust"
        )

    def _scale(self, weight: float, name: str) -> th.ScaleCostWeight:
        return th.ScaleCostWeight(th.Variable(self._tensor([[math.sqrt(weight)]]), name=name))

    def _tensor(self, values: list[Any]) -> torch.Tensor:
        return torch.tensor(values, dtype=self.dtype)


def optimizer_options(problem: Problem) -> dict[str, Any]:
    """Exactly ``iterations`` full steps: no tolerance ends them early."""
    return {
        "linear_solver_cls": th.CholeskyDenseSolver,
        "max_iterations": problem.iterations,
        "step_size": 1.0,
        "abs_err_tolerance": 0.0,
        "rel_err_tolerance": 0.0,
    }


def as_matrices(poses: torch.Tensor) -> np.ndarray:
    """Poses (B, 3, 4) as arrays (B, 4, 4)."""
    T = np.tile(np.eye(4), (len(poses), 1, 1))
    T[:, :3] = poses.cpu().numpy()
    return T


def linearised(objective: th.Objective, optimizer: Any) -> dict[str, np.ndarray]:
    """Cost (B,), J'J (B, 6, 6) and -J'r (B, 6), rotation first, where the objective's variables are."""
    system = optimizer.linear_solver.linearization
    cost = objective.error_metric()
    system.linearize()
    turn = ROTATION_FIRST
    return {
        "cost": cost.cpu().numpy(),
        "information": system.AtA.cpu().numpy()[:, turn][:, :, turn],
        "gradient": system.Atb.cpu().numpy()[:, turn, 0],
    }
