# SPDX-License-Identifier: MIT
r"""The graph that calibrates a robot: all grasps' keyframes, on one camera and one set of joint zeros.

    e, dq       the camera's twist and the joints' zeros: shared by all grasps
    b_g         what the contacts of grasp g stand off its object's mesh, one number a pad
    T_ho(g, i)  pose of the object in the hand, in keyframe i of grasp g

held together by visual poses (``seen_by_camera``), contacts (``offset_contacts``), pads that do not touch
(``clearance``) and the object's slow motion in the hand (GTSAM's ``BetweenFactorPose3``). Neighbouring keyframes err
alike, in vision longer than in touch, so each counts as one of several that say the same.
"""

from __future__ import annotations

import math

import gtsam
import numpy as np
from gtsam.symbol_shorthand import B, C, Q, X

from ..config import EstimatorConfig
from ..factors.clearance import clearance_factor
from ..factors.jointed_pads import JointedPads
from ..factors.noise import welsch_of_norm, welsch_of_rows
from ..factors.offset_contacts import contact_factor
from ..factors.seen_by_camera import seen_factor
from ..sdf.search import ClosestPoints
from .keyframes import GAP, Grasp, Keyframe

CAMERA, ZEROS = C(0), Q(0)  # keys of the shared unknowns
MOST_KEYFRAMES = 100_000  # a grasp's poses have keys of their own

GAP_SIGMA = 0.0005  # [m], a touching pad beside the surface
OVERLAP_SIGMA = 0.0003  # [m], and inside it
CONTACT_THETA = math.log(20.0)  # log of the Welsch loss's theta: 4.5 sigmas
VISION_THETA = math.log(20.0)
CONTACTS_ALIKE = 0.5  # [s], for which errors of contacts last
VISION_ALIKE = 0.75  # [s], and those of visual poses, or longer where a tracker says so

OFFSET = 0.00015  # [m], what a contact stands off the mesh on average
OFFSET_SIGMA = 0.0003  # [m], of one pad
OFFSET_COMMON_SIGMA = 0.0005  # [m], of all pads together: an object that is not quite its mesh

# Fingers that move by so much, squared, move an object in them by so much [rad / rad^2], [m / rad^2].
PUSHED_ROTATION, PUSHED_TRANSLATION = 8.0, 0.4


def pose_key(number: int, index: int) -> int:
    """Key of T_ho in keyframe ``index`` of grasp ``number``."""
    return int(X(number * MOST_KEYFRAMES + index))


def add_grasp(
    graph: gtsam.NonlinearFactorGraph,
    values: gtsam.Values,
    number: int,
    grasp: Grasp,
    camera_origin: np.ndarray,
    config: EstimatorConfig,
) -> None:
    """Put a grasp's factors into a graph, and where its own unknowns start into the values.

    Args:
        graph: Gets the factors.
        values: Gets the poses and the contacts' offsets.
        number: The grasp's, which no other one has.
        grasp: The grasp.
        camera_origin: The point that the camera's twist turns about, in the world [m], shape (3,).
        config: Weight of a visual pose without a covariance, random walk of a held object.
    """
    closest = ClosestPoints(grasp.hand, grasp.obj.sdf)
    count = len(grasp.hand)
    values.insert(B(number), np.full(count, OFFSET))
    graph.push_back(
        gtsam.PriorFactorVector(B(number), np.full(count, OFFSET), _offsets_noise(count))
    )
    touch = _repetitions(CONTACTS_ALIKE, grasp.spacing)
    seen = sum(frame.T_wo_visual is not None for frame in grasp.keyframes)
    before: Keyframe | None = None
    for index, frame in enumerate(grasp.keyframes):
        key = pose_key(number, index)
        values.insert(key, frame.T_ho)
        if frame.T_wo_visual is not None:
            vision = min(_vision_repetitions(frame, grasp.spacing), seen)
            graph.push_back(
                seen_factor(
                    key,
                    CAMERA,
                    frame.T_wh,
                    frame.T_wo_visual,
                    camera_origin,
                    _visual_noise(frame, config, vision),
                )
            )
        pads = JointedPads(grasp.hand, closest, frame.joints, frame.touching)
        touching = int(np.count_nonzero(frame.touching))
        graph.push_back(
            contact_factor(
                key,
                ZEROS,
                B(number),
                pads,
                GAP_SIGMA,
                OVERLAP_SIGMA,
                _contact_noise(touching, touch),
            )
        )
        if touching < count:
            graph.push_back(
                clearance_factor(key, ZEROS, pads, _clearance_noise(count - touching, touch))
            )
        if before is not None and frame.time - before.time <= GAP * grasp.spacing:
            noise = _motion_noise(before, frame, config)
            graph.push_back(gtsam.BetweenFactorPose3(key - 1, key, gtsam.Pose3(), noise))
        before = frame


def _repetitions(alike: float, spacing: float) -> float:
    """As how many keyframes that say the same one counts."""
    return max(1.0, alike / spacing)


def _vision_repetitions(frame: Keyframe, spacing: float) -> float:
    """The same for its visual pose, if a grasp were endless: all of one are worth one at least."""
    return _repetitions(max(VISION_ALIKE, frame.visual_correlation), spacing)


def _visual_noise(frame: Keyframe, config: EstimatorConfig, n: float) -> gtsam.noiseModel.Base:
    covariance = frame.visual_covariance
    if covariance is None:
        covariance = np.diag(1.0 / np.repeat(config.visual_weights, 3))
    noise = gtsam.noiseModel.Gaussian.Covariance(n * covariance)
    return welsch_of_norm(noise, VISION_THETA - math.log(n))


def _contact_noise(touching: int, n: float) -> gtsam.noiseModel.Base:
    noise = gtsam.noiseModel.Isotropic.Sigma(touching, math.sqrt(n))
    return welsch_of_rows(noise, CONTACT_THETA - math.log(n))


def _clearance_noise(apart: int, n: float) -> gtsam.noiseModel.Base:
    return gtsam.noiseModel.Isotropic.Sigma(apart, math.sqrt(n) * OVERLAP_SIGMA)


def _offsets_noise(count: int) -> gtsam.noiseModel.Base:
    covariance = OFFSET_SIGMA**2 * np.eye(count) + OFFSET_COMMON_SIGMA**2
    return gtsam.noiseModel.Gaussian.Covariance(covariance)


def _motion_noise(
    before: Keyframe, frame: Keyframe, config: EstimatorConfig
) -> gtsam.noiseModel.Base:
    """How far an object moves in the hand between two keyframes: by itself, and pushed by fingers that move."""
    dt = frame.time - before.time
    moved = float(np.abs(frame.joints - before.joints).max()) ** 2
    rotation = math.hypot(config.held.rotation * math.sqrt(dt), PUSHED_ROTATION * moved)
    translation = math.hypot(config.held.translation * math.sqrt(dt), PUSHED_TRANSLATION * moved)
    return gtsam.noiseModel.Diagonal.Sigmas(np.repeat([rotation, translation], 3))
