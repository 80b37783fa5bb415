# SPDX-License-Identifier: MIT
"""A frame's factor graph over the one pose ``OBJECT``; what no frame changes is made once."""

from __future__ import annotations

import gtsam
from gtsam.symbol_shorthand import X

from ..config import EstimatorConfig
from ..factors.hand import HandTerms, hand_factor
from ..factors.noise import gaussian, pose_noise, welsch_of_norm
from ..factors.visual import visual_factor
from ..frame import Frame

OBJECT = X(0)  # key of the object pose T_wo


class GraphBuilder:
    """Makes each frame's factor graph.

    Args:
        terms: The hand's terms, to be placed at each frame's pads.
        config: Method, weights and losses.
    """

    def __init__(self, terms: HandTerms, config: EstimatorConfig) -> None:
        self._log_theta = config.log_theta_vis
        self._visual_noise = self._robust(pose_noise(*config.visual_weights))
        self._hand = None if config.method == "vis" else hand_factor(OBJECT, terms)

    def build(self, frame: Frame) -> gtsam.NonlinearFactorGraph:
        """The frame's factors: the visual one and the hand's, as far as the frame and the method have them."""
        graph = gtsam.NonlinearFactorGraph()
        if frame.T_wo_visual is not None:
            noise = self._visual_noise
            if frame.visual_covariance is not None:
                noise = self._robust(gaussian(frame.visual_covariance))
            graph.push_back(visual_factor(OBJECT, frame.T_wo_visual, noise))
        if self._hand is not None:
            graph.push_back(self._hand)
        return graph

    def _robust(self, noise: gtsam.noiseModel.Base) -> gtsam.noiseModel.Robust:
        return welsch_of_norm(noise, self._log_theta)
