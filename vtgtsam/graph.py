# SPDX-License-Identifier: MIT
r"""One frame's factor graph (paper, eq. 4), over the pose of the object in the hand.

    T_ho* = argmin  1/2 rho_vis(||Log(T_ho_visual^-1 T_ho)||^2_w_vis)
                  + 1/2 sum_k rho_tac(w_tac max(0, phi(T_ho^-1 p_k))^2)      pads in contact
                  + 1/2 sum_k         w_pen min(0, phi(T_ho^-1 p_k))^2       all pads

with p_k pad k's grid point of least signed distance phi to the object. ``build_graph`` is the door for graphs of one's
own: windows of frames, several objects, other factors.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import gtsam
import numpy as np

from .config import EstimatorConfig
from .factors.noise import distance_noise, pose_noise, welsch_of_norm, welsch_of_rows
from .factors.pad_distances import JointZeros, PadDistances
from .factors.penetration import penetration_factor
from .factors.tactile import tactile_factor
from .factors.visual import visual_factor
from .frame import Frame, check
from .hands.pads import PadSet
from .measurement import Measurement
from .offsets import CalibrationPrior
from .sdf.search import ClosestPoints


class FrameFactors(NamedTuple):
    """A frame's factors, as far as the frame and the method have them.

    Attributes:
        key: Key of the object's pose T_ho.
        pads: What the hand's factors share.
        visual: Holds the object at the visual pose.
        tactile: Pulls its surface onto the pads that touch.
        penetration: Pushes it out of all pads.
        zeros: What is known of the joints' zeros, where the pads' factors have them as an unknown.
        images_alike: As one of how many images that err alike the visual pose counts.
    """

    key: int
    pads: PadDistances
    visual: gtsam.PriorFactorPose3 | None = None
    tactile: gtsam.CustomFactor | None = None
    penetration: gtsam.CustomFactor | None = None
    zeros: gtsam.PriorFactorVector | None = None
    images_alike: float = 1.0

    def graph(self) -> gtsam.NonlinearFactorGraph:
        """The factors together: the frame's cost."""
        return _graph(self.visual, self.tactile, self.penetration, self.zeros)

    def hand_graph(self) -> gtsam.NonlinearFactorGraph:
        """What the hand alone says."""
        return _graph(self.tactile, self.penetration, self.zeros)

    def normal_equations(
        self, graph: gtsam.NonlinearFactorGraph, values: gtsam.Values
    ) -> tuple[np.ndarray, np.ndarray]:
        """J'J and -J'r of a graph of these factors, the pose's rows first, shape (6 + J, 6 + J) and (6 + J,).

        Robust losses count with the weights that they leave. J is 0 where the joints' zeros are no unknown.
        """
        if graph.empty():
            return np.zeros((6, 6)), np.zeros(6)
        ordering = gtsam.Ordering()
        ordering.push_back(self.key)
        for other in graph.keyVector():
            if other != self.key:
                ordering.push_back(other)
        H, b = graph.linearize(values).hessian(ordering)
        return H, b

    def information(self, graph: gtsam.NonlinearFactorGraph, values: gtsam.Values) -> np.ndarray:
        """Information about the pose in a graph of these factors, other unknowns marginalized out, shape (6, 6)."""
        H, _ = self.normal_equations(graph, values)
        if len(H) == 6:
            return H
        information: np.ndarray = H[:6, :6] - H[:6, 6:] @ np.linalg.solve(H[6:, 6:], H[6:, :6])
        return information


def build_graph(
    measurement: Measurement,
    closest: ClosestPoints,
    key: int,
    config: EstimatorConfig | None = None,
) -> gtsam.NonlinearFactorGraph:
    """One frame's factors on T_ho, the pose of the object in the hand (in the world, where the frame has no T_wh).

    The graph is a value: no later frame changes it, and graphs may be joined, solved and marginalized like any others.
    The hand's joints count as exact in it.

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
    faults = frame.faults if math.isfinite(frame.time) else ("time not finite", *frame.faults)
    if faults:
        raise ValueError(f"the measurement cannot be used: {', '.join(faults)}")
    return frame_factors(frame, closest, key, config).graph()


def frame_factors(
    frame: Frame,
    closest: ClosestPoints,
    key: int,
    config: EstimatorConfig,
    prior: CalibrationPrior | None = None,
    zeros_key: int | None = None,
    T_ho: gtsam.Pose3 | None = None,
    images_alike: float = 1.0,
) -> FrameFactors:
    """The factors of a frame's cost.

    Args:
        frame: The frame.
        closest: Finds the pads' closest points.
        key: Key of the object's pose T_ho.
        config: Method, weights and losses.
        prior: What is known of the robot's offsets; None: it is perfectly calibrated.
        zeros_key: Key of the joints' zeros, where ``prior`` has them uncertain.
        T_ho: About where the object is, which says how its distances depend on the zeros.
        images_alike: As one of how many images that err alike the visual pose counts (``memory``).
    """
    pads = PadDistances(closest, frame.T_hp, frame.touching)
    factors = FrameFactors(key, pads)
    if frame.T_ho_visual is not None:
        noise: gtsam.noiseModel.Base = visual_noise(frame, config, prior, images_alike)
        visual = visual_factor(key, frame.T_ho_visual, noise)
        factors = factors._replace(visual=visual, images_alike=images_alike)
    if config.method == "vis" or not frame.pads_known:
        return factors
    zeros = None
    if prior is not None and prior.joints_uncertain and frame.joints is not None:
        assert zeros_key is not None and T_ho is not None
        jacobian = zero_jacobian(closest.pads, frame.joints, pads, T_ho)
        zeros = JointZeros(zeros_key, jacobian)
        known = gtsam.PriorFactorVector(zeros_key, np.zeros(jacobian.shape[1]), prior.joint_noise())
        factors = factors._replace(zeros=known)
    blurred = config.pad_sigma**2 if frame.joints is None else 0.0
    touching = np.count_nonzero(frame.touching)
    if touching and "tac" in config.method:
        noise = distance_noise(touching, 1.0 / (1.0 / config.w_tac + blurred))
        robust = welsch_of_rows(noise, config.log_theta_tac)
        factors = factors._replace(tactile=tactile_factor(key, pads, robust, zeros))
    noise = distance_noise(len(frame.touching), 1.0 / (1.0 / config.w_pen + blurred))
    return factors._replace(penetration=penetration_factor(key, pads, noise, zeros))


def zero_jacobian(
    hand: PadSet, joints: np.ndarray, pads: PadDistances, T_ho: gtsam.Pose3
) -> np.ndarray:
    """G = d phi / d dq [m/rad], shape (K, J), with the object at T_ho; zero for a pad that is left out."""
    contacts = pads.at(T_ho)
    points_h = np.nan_to_num(pads.points_h(contacts))
    gradients_h = -contacts.jacobians[:, 3:] @ T_ho.rotation().matrix().T
    return hand.zero_jacobian(joints, points_h, gradients_h)  # type: ignore[attr-defined, no-any-return]


def visual_noise(
    frame: Frame,
    config: EstimatorConfig,
    prior: CalibrationPrior | None = None,
    images_alike: float = 1.0,
) -> gtsam.noiseModel.Robust:
    """How sure a frame's visual pose is: its own covariance or the configured weights, and the camera's share.

    As one of n images that err alike its whole loss counts 1/n, rho(e) / n, which is Welsch's of e / n and theta / n.
    """
    log_theta = config.visual_log_theta - math.log(images_alike)
    if frame.visual_covariance is None and (prior is None or not prior.camera_uncertain):
        rotation, translation = config.visual_weights
        noise = pose_noise(rotation / images_alike, translation / images_alike)
    else:
        covariance = total_covariance(frame, config, prior)
        noise = gtsam.noiseModel.Gaussian.Covariance(images_alike * covariance)
    return welsch_of_norm(noise, log_theta)


def total_covariance(
    frame: Frame, config: EstimatorConfig, prior: CalibrationPrior | None
) -> np.ndarray:
    """Of a frame's visual pose, shape (6, 6): the tracker's, and the camera's share."""
    covariance = tracker_covariance(frame, config)
    if prior is None or not prior.camera_uncertain:
        return covariance
    assert frame.T_wo_visual is not None
    total: np.ndarray = covariance + prior.camera_share(frame.T_wo_visual)
    return total


def tracker_covariance(frame: Frame, config: EstimatorConfig) -> np.ndarray:
    """Of a frame's visual pose, without the camera's share, shape (6, 6): its own, or by the configured weights."""
    if frame.visual_covariance is not None:
        return frame.visual_covariance
    return np.diag(1.0 / np.repeat(config.visual_weights, 3))


def _graph(*factors: gtsam.NonlinearFactor | None) -> gtsam.NonlinearFactorGraph:
    graph = gtsam.NonlinearFactorGraph()
    for factor in factors:
        if factor is not None:
            graph.add(factor)
    return graph
