# SPDX-License-Identifier: MIT
r"""One frame's factor graph (paper, eq. 4), over the pose of the object in the hand.

    T_ho* = argmin  1/2 rho_vis(||Log(T_ho_visual^-1 T_ho)||^2_w_vis)
                  + 1/2 sum_k rho_tac(w_tac max(0, phi(T_ho^-1 p_k))^2)      pads in contact
                  + 1/2 sum_k         w_pen min(0, phi(T_ho^-1 p_k))^2       all pads

with p_k pad k's grid point of least signed distance phi to the object. ``build_graph`` is the door for graphs of one's
own: windows of frames, several objects, other factors.
"""

from __future__ import annotations

from typing import NamedTuple

import gtsam
import numpy as np

from .config import EstimatorConfig
from .factors.noise import distance_noise, pose_noise, welsch_of_norm, welsch_of_rows
from .factors.pad_distances import PadDistances
from .factors.penetration import penetration_factor
from .factors.tactile import tactile_factor
from .factors.visual import visual_factor
from .frame import Frame, check
from .measurement import Measurement
from .sdf.search import ClosestPoints


class FrameFactors(NamedTuple):
    """A frame's factors, as far as the frame and the method have them.

    Attributes:
        pads: What the hand's factors share.
        visual: Holds the object at the visual pose.
        tactile: Pulls its surface onto the pads that touch.
        penetration: Pushes it out of all pads.
    """

    pads: PadDistances
    visual: gtsam.PriorFactorPose3 | None = None
    tactile: gtsam.CustomFactor | None = None
    penetration: gtsam.CustomFactor | None = None

    def graph(self) -> gtsam.NonlinearFactorGraph:
        """The factors together: the frame's cost."""
        return _graph(self.visual, self.tactile, self.penetration)

    def hand_graph(self) -> gtsam.NonlinearFactorGraph:
        """What the hand alone says."""
        return _graph(self.tactile, self.penetration)


def build_graph(
    measurement: Measurement,
    closest: ClosestPoints,
    key: int,
    config: EstimatorConfig | None = None,
) -> gtsam.NonlinearFactorGraph:
    """One frame's factors on T_ho, the pose of the object in the hand (in the world, where the frame has no T_wh).

    The graph is a value: no later frame changes it, and graphs may be joined, solved and marginalized like any others.

    Args:
        measurement: The frame.
        closest: ``ClosestPoints(hand, obj.sdf)``: finds closest points, the sooner the more it has been asked. Graphs
            of the same hand and object may share it; those that different threads solve may not.
        key: Key of T_ho.
        config: Method, weights and losses; the recommended ones where not given.

    Raises:
        ValueError: The measurement has the wrong shape or names, lacks something, or is not finite.
    """
    config = EstimatorConfig() if config is None else config
    frame = check(measurement, closest.pads, config.use_visual_covariance)
    if frame.invalid:
        raise ValueError(f"the measurement is not finite: {frame.invalid}")
    return frame_factors(frame, closest, key, config).graph()


def frame_factors(
    frame: Frame, closest: ClosestPoints, key: int, config: EstimatorConfig
) -> FrameFactors:
    """The factors of a frame's cost."""
    pads = PadDistances(closest, frame.T_hp, frame.touching)
    factors = FrameFactors(pads)
    if frame.T_ho_visual is not None:
        noise: gtsam.noiseModel.Base = visual_noise(frame, config)
        factors = factors._replace(visual=visual_factor(key, frame.T_ho_visual, noise))
    touching = np.count_nonzero(frame.touching)
    if touching and config.method == "vis+tac+pen":
        noise = welsch_of_rows(distance_noise(touching, config.w_tac), config.log_theta_tac)
        factors = factors._replace(tactile=tactile_factor(key, pads, noise))
    if config.method != "vis":
        noise = distance_noise(len(frame.touching), config.w_pen)
        factors = factors._replace(penetration=penetration_factor(key, pads, noise))
    return factors


def visual_noise(frame: Frame, config: EstimatorConfig) -> gtsam.noiseModel.Robust:
    """How sure a frame's visual pose is: its own covariance where it brings one, else the configured weights."""
    if frame.visual_covariance is None:
        noise = pose_noise(*config.visual_weights)
    else:
        noise = gtsam.noiseModel.Gaussian.Covariance(frame.visual_covariance)
    return welsch_of_norm(noise, config.log_theta_vis)


def _graph(*factors: gtsam.NonlinearFactor | None) -> gtsam.NonlinearFactorGraph:
    graph = gtsam.NonlinearFactorGraph()
    for factor in factors:
        if factor is not None:
            graph.add(factor)
    return graph
