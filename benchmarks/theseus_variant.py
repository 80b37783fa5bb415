# SPDX-License-Identifier: MIT
"""The same problem in Theseus, tuned; runs in Theseus' own environment (``make theseus``).

One tactile and one penetration cost for all pads, with analytic Jacobians, which share one search per pose; no
vectorisation (three costs of three kinds leave it nothing to vectorise), no autograd, no Lie group checks.

``lie="theseus"`` uses Theseus' own ``Difference`` and ``SE3``; ``lie="bare"`` replaces their exponential and
logarithm, two thirds of that frame, with ``torch_lie``.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import theseus as th
import torch

from .problem import Problem
from .theseus_common import Frames, Weights, as_matrices, linearised, optimizer_options
from .torch_lie import Lie
from .torch_search import PadSearch


class TactileCost(th.CostFunction):
    """max(0, phi) of each touching pad, 0 of the others; a row a pad."""

    def __init__(self, weight: Any, pose: Any, touching: Any, search: PadSearch) -> None:
        super().__init__(weight, name="tactile")
        self.pose, self.touching, self.search = pose, touching, search
        self.register_optim_vars(["pose"])
        self.register_aux_vars(["touching"])

    def dim(self) -> int:
        """Rows."""
        return int(self.touching.shape[1])

    def error(self) -> torch.Tensor:
        """Residual (B, rows)."""
        return self.search.at(self.pose.tensor)[0].relu() * self.touching.tensor

    def jacobians(self) -> tuple[list[torch.Tensor], torch.Tensor]:
        """Jacobians (B, rows, 6) and residual."""
        phi, J = self.search.at(self.pose.tensor)
        pulls = self.touching.tensor * (phi > 0)
        return [J * pulls[..., None]], phi * pulls

    def _copy_impl(self, new_name: str | None = None) -> TactileCost:
        return TactileCost(self.weight.copy(), self.pose.copy(), self.touching.copy(), self.search)


class PenetrationCost(th.CostFunction):
    """min(0, phi) of every pad; a row a pad."""

    def __init__(self, weight: Any, pose: Any, pads: int, search: PadSearch) -> None:
        super().__init__(weight, name="penetration")
        self.pose, self.pads, self.search = pose, pads, search
        self.register_optim_vars(["pose"])

    def dim(self) -> int:
        """Rows."""
        return self.pads

    def error(self) -> torch.Tensor:
        """Residual (B, rows)."""
        return self.search.at(self.pose.tensor)[0].clamp(max=0)

    def jacobians(self) -> tuple[list[torch.Tensor], torch.Tensor]:
        """Jacobians (B, rows, 6) and residual."""
        phi, J = self.search.at(self.pose.tensor)
        inside = phi < 0
        return [J * inside[..., None]], phi * inside

    def _copy_impl(self, new_name: str | None = None) -> PenetrationCost:
        return PenetrationCost(self.weight.copy(), self.pose.copy(), self.pads, self.search)


class VisualCost(th.CostFunction):
    """log(T_wo^-1 T_wo_visual), translation first, with the logarithm of ``torch_lie``."""

    def __init__(self, weight: Any, pose: Any, visual: Any, lie: Lie) -> None:
        super().__init__(weight, name="visual")
        self.pose, self.visual, self.lie = pose, visual, lie
        self.register_optim_vars(["pose"])
        self.register_aux_vars(["visual"])
        self._at: tuple[Any, Any] = (None, None)

    def dim(self) -> int:
        """Rows."""
        return 6

    def error(self) -> torch.Tensor:
        """Residual (B, rows)."""
        return self._log()[0]

    def jacobians(self) -> tuple[list[torch.Tensor], torch.Tensor]:
        """Jacobians (B, rows, 6) and residual."""
        xi, inverse_left = self._log()
        return [-inverse_left], xi

    def _log(self) -> tuple[torch.Tensor, torch.Tensor]:
        T, V = self.pose.tensor, self.visual.tensor
        if self._at[0] is not T or self._at[1] is not V:
            Rt = T[:, :, :3].mT
            relative = torch.cat([Rt @ V[:, :, :3], Rt @ (V[:, :, 3:] - T[:, :, 3:])], dim=2)
            self._at, self._found = (T, V), self.lie.log(relative)
        return self._found

    def _copy_impl(self, new_name: str | None = None) -> VisualCost:
        return VisualCost(self.weight.copy(), self.pose.copy(), self.visual.copy(), self.lie)


class BarePose(th.SE3):
    """An SE3 variable whose retraction is ``torch_lie``'s."""

    lie: Lie

    @classmethod
    def of(cls, pose: th.SE3, lie: Lie) -> BarePose:
        """The same variable, with this exponential."""
        bare = cls(tensor=pose.tensor, name=pose.name, disable_checks=True)
        bare.lie = lie
        return bare

    def _retract_impl(self, delta: torch.Tensor) -> th.SE3:
        E, T = self.lie.exp(delta), self.tensor
        moved = T[:, :, :3] @ E
        moved[:, :, 3] += T[:, :, 3]
        return th.SE3(tensor=moved, disable_checks=True)

    def _copy_impl(self, new_name: str | None = None) -> BarePose:
        return BarePose.of(
            th.SE3(tensor=self.tensor.clone(), name=new_name, disable_checks=True), self.lie
        )


class TheseusSolver:
    """Solves batches of a problem's frames.

    Args:
        problem: The problem.
        dtype: "float32" or "float64".
        device: "cpu" or "cuda".
        lie: "theseus" or "bare", see above.
        sampler: "grid_sample" or "gathers", see ``torch_search``.
    """

    def __init__(
        self,
        problem: Problem,
        dtype: str = "float32",
        device: str = "cpu",
        lie: str = "theseus",
        sampler: str = "grid_sample",
    ) -> None:
        self.frames = Frames(problem, getattr(torch, dtype), device)
        self.search = PadSearch(problem, self.frames.dtype, device, sampler)
        self.contacts = self.frames.contacts[:, self.search.order]
        self.objective = th.Objective(dtype=self.frames.dtype)
        for cost in self._costs(problem, lie):
            self.objective.add(cost)
        self.objective.to(device)
        self.optimizer = th.LevenbergMarquardt(
            self.objective, vectorize=False, **optimizer_options(problem)
        )

    def _costs(self, problem: Problem, lie: str) -> list[th.CostFunction]:
        weights = Weights(problem, self.frames.dtype)
        pose, visual = weights.identity("pose"), weights.identity("visual")
        touching = th.Variable(self.contacts[:1].cpu(), name="touching")
        if lie == "bare":
            group = Lie(self.frames.dtype, self.frames.device)
            pose = BarePose.of(pose, group)
            seen = VisualCost(weights.visual, pose, visual, group)
        else:
            seen = th.Difference(pose, visual, weights.visual, name="visual_cost")
        tactile = TactileCost(weights.tactile, pose, touching, self.search)
        return [
            weights.robust(seen, problem.log_theta_vis, flatten=False),
            weights.robust(tactile, problem.log_theta_tac, flatten=True),
            PenetrationCost(weights.penetration, pose, problem.pads, self.search),
        ]

    def inputs(self, frames: slice, T_start: np.ndarray) -> dict[str, torch.Tensor]:
        """These frames and their starts (B, 4, 4) as tensors."""
        return self.frames.inputs(frames, T_start) | {"touching": self.contacts[frames]}

    def solve(self, inputs: dict[str, torch.Tensor]) -> np.ndarray:
        """Object poses (B, 4, 4)."""
        with torch.inference_mode(), th.no_lie_group_check(silent=True):
            self._place(inputs)
            self.optimizer.optimize(damping=self.frames.damping)
            return as_matrices(self.objective.get_optim_var("pose").tensor)

    def linearise(self, inputs: dict[str, torch.Tensor]) -> dict[str, np.ndarray]:
        """Cost (B,), J'J (B, 6, 6) and -J'r (B, 6), rotation first, at the frames' starts."""
        with torch.inference_mode(), th.no_lie_group_check(silent=True):
            self._place(inputs)
            return linearised(self.objective, self.optimizer)

    def _place(self, inputs: dict[str, torch.Tensor]) -> None:
        self.search.place(inputs["T_wp"])
        self.objective.update({name: inputs[name] for name in ("pose", "visual", "touching")})
