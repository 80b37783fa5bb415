# SPDX-License-Identifier: MIT
"""A recorded grasp as the calibration uses it: few frames, each at the pose that memory gave it.

A graph of contacts has many minima, so where it starts decides: at the poses of an estimator with memory. Visual poses
that memory refused are left out, for a tracker that sits beside the object for seconds looks like a camera that is off.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import NamedTuple

import gtsam
import numpy as np

from ..estimator import PoseEstimator
from ..faults import words
from ..frame import Frame, check, contact_bits
from ..hands.model import HandModel
from ..measurement import Measurement
from ..objects import ObjectModel

SPACING = 1 / 6  # [s], between keyframes
BELIEVED = 0.3  # visual weight below which memory has refused a visual pose
OFTEN = 0.25  # share of the frames
USELESS = {
    words.JOINTS_NOT_FINITE,
    words.HAND_POSE_NOT_FINITE,
    words.PADS_NOT_FINITE,
    words.TIME_WENT_BACK,
    words.JOINTS_DEGREES,
    words.HAND_FROZEN,
    words.CONTACTS_INVERTED,
    words.NO_FIT,
}
BLIND = {words.VISION_REPEATS, words.VISION_JUMPS, words.VISION_FAR, words.VISION_MILLIMETRES}
GAP = 2.5 * SPACING  # [s], between keyframes farther apart the object may have been anywhere


class Keyframe(NamedTuple):
    """One frame of a grasp, in which a pad touches.

    Attributes:
        time: Its instant [s].
        joints: Joint angles as measured [rad], shape (J,).
        touching: Which pads report contact, bool, shape (K,).
        T_wh: Pose of the hand in the world.
        T_ho: Pose of the object in the hand, as memory has it.
        T_wo_visual: The visual pose as reported, or None where there is none or memory refused it.
        visual_covariance: Its covariance, shape (6, 6), or None where it has none.
    """

    time: float
    joints: np.ndarray
    touching: np.ndarray
    T_wh: gtsam.Pose3
    T_ho: gtsam.Pose3
    T_wo_visual: gtsam.Pose3 | None
    visual_covariance: np.ndarray | None


class Grasp(NamedTuple):
    """A recorded grasp, or what is left of it.

    Attributes:
        name: What the recording is called.
        hand: Its hand.
        obj: Its object.
        keyframes: In the order of time.
        seen: Share of the frames that touch whose visual pose memory believed.
        sigma: Median standard deviation of the estimated positions while a pad touches [m].
        faults: What was wrong with many of the frames, in the fixed words of ``faults``.
    """

    name: str
    hand: HandModel
    obj: ObjectModel
    keyframes: list[Keyframe]
    seen: float
    sigma: float
    faults: tuple[str, ...]


def grasp(name: str, estimator: PoseEstimator, frames: Sequence[Measurement]) -> Grasp:
    """Track a recording with memory, and keep its keyframes.

    Args:
        name: What to call it.
        estimator: One with memory, which has seen nothing yet; it corrects what is known of the robot itself.
        frames: What was recorded.
    """
    hand = estimator.hand
    assert isinstance(hand, HandModel)
    keyframes: list[Keyframe] = []
    believed: list[bool] = []
    spread: list[float] = []
    faults: Counter[str] = Counter()
    for measured in frames:
        estimate = estimator.update(measured)
        touching = contact_bits(measured.contacts, hand.pad_names)
        faults.update(estimate.faults)
        if USELESS.intersection(estimate.faults) or estimate.T_wo is None or not touching.any():
            continue
        blind = bool(BLIND.intersection(estimate.faults))
        believed.append(estimate.visual_weight >= BELIEVED and not blind)
        spread.append(float(np.trace(estimate.covariance[3:, 3:])))
        if keyframes and measured.time < keyframes[-1].time + SPACING - 1e-3:
            continue
        keyframes.append(_keyframe(check(measured, hand), estimate.T_wo, believed[-1]))
    seen = float(np.mean(believed)) if believed else 0.0
    sigma = float(np.sqrt(np.median(spread))) if spread else float("inf")
    often = tuple(fault for fault, count in faults.most_common() if count >= OFTEN * len(frames))
    return Grasp(name, hand, estimator.obj, keyframes, seen, sigma, often)


def _keyframe(frame: Frame, T_wo: gtsam.Pose3, believed: bool) -> Keyframe:
    """A frame as it was measured, at a pose."""
    assert frame.joints is not None  # what has no fault has joints
    return Keyframe(
        time=frame.time,
        joints=frame.joints,
        touching=frame.touching,
        T_wh=frame.T_wh,
        T_ho=frame.T_wh.between(T_wo),
        T_wo_visual=frame.T_wo_visual if believed else None,
        visual_covariance=frame.visual_covariance,
    )
