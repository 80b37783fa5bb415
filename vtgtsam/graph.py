# SPDX-License-Identifier: MIT
"""A frame's factor graph over the one pose ``OBJECT``; what no frame changes is made once."""

from __future__ import annotations

from dataclasses import dataclass

import gtsam
import numpy as np
from gtsam.symbol_shorthand import X

from .config import EstimatorConfig
from .factors.noise import gaussian, isotropic, pose_noise, welsch_of_each, welsch_of_norm
from .factors.penetration import penetration_factor
from .factors.tactile import tactile_factor
from .factors.visual import visual_factor
from .frame import Frame
from .sdf.closest import ClosestPoints

OBJECT = X(0)  # key of the object pose T_wo


@dataclass(frozen=True, eq=False)
class FrameGraph:
    """One frame's factors.

    Attributes:
        visual: The visual factor, or None where the frame has no visual pose.
        hand: Tactile and penetration factors, those that the method and the frame have.
        graph: All of them.
    """

    visual: gtsam.NonlinearFactor | None
    hand: tuple[gtsam.NonlinearFactor, ...]
    graph: gtsam.NonlinearFactorGraph


class GraphBuilder:
    """Makes each frame's factors.

    Args:
        closest: The search that the pad factors share, to be placed at each frame's pads.
        pads: Number of pads K.
        config: Method, weights and losses.
    """

    def __init__(self, closest: ClosestPoints, pads: int, config: EstimatorConfig) -> None:
        self._closest = closest
        self._config = config
        self._visual_noise = self._robust(pose_noise(*config.visual_weights))
        self._tactile_noise = [
            welsch_of_each(isotropic(count, config.w_tac), config.log_theta_tac)
            for count in range(1, pads + 1)
        ]
        self._penetration = penetration_factor(OBJECT, closest, isotropic(pads, config.w_pen))

    def build(self, frame: Frame) -> FrameGraph:
        """The frame's factors; ``closest`` must have been placed at the frame's pads."""
        visual = None
        if frame.T_wo_visual is not None:
            noise = self._visual_noise
            if frame.visual_covariance is not None:
                noise = self._robust(gaussian(frame.visual_covariance))
            visual = visual_factor(OBJECT, frame.T_wo_visual, noise)
        hand = self._hand(frame)
        return FrameGraph(visual, hand, as_graph(hand if visual is None else (visual, *hand)))

    def _hand(self, frame: Frame) -> tuple[gtsam.NonlinearFactor, ...]:
        if self._config.method == "vis":
            return ()
        touching = np.flatnonzero(frame.touching)
        if self._config.method == "vis+pen" or not len(touching):
            return (self._penetration,)
        noise = self._tactile_noise[len(touching) - 1]
        return tactile_factor(OBJECT, touching, self._closest, noise), self._penetration

    def _robust(self, noise: gtsam.noiseModel.Base) -> gtsam.noiseModel.Robust:
        return welsch_of_norm(noise, self._config.log_theta_vis)


def as_graph(factors: tuple[gtsam.NonlinearFactor, ...]) -> gtsam.NonlinearFactorGraph:
    """The factors as a graph."""
    graph = gtsam.NonlinearFactorGraph()
    for factor in factors:
        graph.push_back(factor)
    return graph
