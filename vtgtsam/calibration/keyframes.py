# SPDX-License-Identifier: MIT
"""A recorded grasp as the calibration uses it: few frames, each at the pose that memory gave it.

A graph of contacts has many minima, so where it starts decides: at the poses of an estimator with memory. Visual poses
that memory refused are left out, for a tracker that sits beside the object for seconds looks like a camera that is off.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import NamedTuple

import gtsam
import numpy as np

from ..estimate import Estimate
from ..estimator import PoseEstimator
from ..faults import words
from ..frame import Frame, check, contact_bits
from ..hands.model import HandModel
from ..measurement import Measurement
from ..objects import ObjectModel

TRACKED = 0.1  # [s], frames of a recording that are closer say much the same: one is tracked
SPACING = 0.3  # [s], between keyframes
ROUNDING = 0.002  # [s], of stamps
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
GAP = 2.5  # [spacings], between keyframes farther apart the object may have been anywhere


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
        visual_correlation: How long its errors stay alike [s].
    """

    time: float
    joints: np.ndarray
    touching: np.ndarray
    T_wh: gtsam.Pose3
    T_ho: gtsam.Pose3
    T_wo_visual: gtsam.Pose3 | None
    visual_covariance: np.ndarray | None
    visual_correlation: float = 0.0


class Grasp(NamedTuple):
    """A grasp, or what is left of it.

    Attributes:
        name: What the recording is called.
        hand: Its hand.
        obj: Its object.
        keyframes: In the order of time.
        spacing: Between neighbouring ones at least [s].
        seen: Share of the frames that touch whose visual pose memory believed.
        sigma: Median standard deviation of the estimated positions while a pad touches [m].
        faults: What was wrong with many of the frames, in the fixed words of ``faults``.
    """

    name: str
    hand: HandModel
    obj: ObjectModel
    keyframes: list[Keyframe]
    spacing: float
    seen: float
    sigma: float
    faults: tuple[str, ...]


class GraspLog:
    """Collects a grasp's keyframes, one frame after another.

    Args:
        hand: The hand.
        obj: The object.
        most: The most keyframes; beyond, every other one is dropped, and from then on half as many are taken.
    """

    def __init__(self, hand: HandModel, obj: ObjectModel, most: int | None = None) -> None:
        self._hand, self._obj, self._most = hand, obj, most
        self.keyframes: list[Keyframe] = []
        self._spacing = SPACING
        self._frames = 0
        self._touched = 0
        self._believed = 0
        self._variances: list[float] = []
        self._faults: Counter[str] = Counter()

    def add(self, measured: Measurement, estimate: Estimate) -> None:
        """Note a frame.

        Args:
            measured: As the robot measured it, not corrected.
            estimate: What an estimator with memory made of it.
        """
        self._frames += 1
        self._faults.update(estimate.faults)
        touching = contact_bits(measured.contacts, self._hand.pad_names)
        if USELESS.intersection(estimate.faults) or estimate.T_wo is None or not touching.any():
            return
        blind = bool(BLIND.intersection(estimate.faults))
        believed = estimate.visual_weight >= BELIEVED and not blind
        self._touched += 1
        self._believed += believed
        self._variances.append(float(np.trace(estimate.covariance[3:, 3:])))
        keyframes = self.keyframes
        if keyframes and measured.time < keyframes[-1].time + self._spacing - ROUNDING:
            return
        keyframes.append(_keyframe(check(measured, self._hand), estimate.T_wo, believed))
        if self._most is not None and len(keyframes) > self._most:
            del keyframes[1::2]
            self._spacing *= 2

    def place(self, poses: Mapping[float, gtsam.Pose3]) -> None:
        """Have the keyframes of some instants at better poses of the object in the hand."""
        self.keyframes = [
            frame._replace(T_ho=poses.get(frame.time, frame.T_ho)) for frame in self.keyframes
        ]

    def grasp(self, name: str) -> Grasp:
        """What has come together so far, under a name."""
        often = OFTEN * self._frames
        return Grasp(
            name=name,
            hand=self._hand,
            obj=self._obj,
            keyframes=list(self.keyframes),
            spacing=self._spacing,
            seen=self._believed / self._touched if self._touched else 0.0,
            sigma=float(np.sqrt(np.median(self._variances))) if self._variances else float("inf"),
            faults=tuple(f for f, count in self._faults.most_common() if count >= often),
        )


def grasp(name: str, estimator: PoseEstimator, frames: Sequence[Measurement]) -> Grasp:
    """Track a recording with memory, at 10 Hz at most, and keep its keyframes.

    Args:
        name: What to call it.
        estimator: One with memory, which has seen nothing yet; it corrects what is known of the robot itself.
        frames: What was recorded.
    """
    assert isinstance(estimator.hand, HandModel)
    log = GraspLog(estimator.hand, estimator.obj)
    last = -math.inf
    for measured in frames:
        if measured.time >= last + TRACKED - ROUNDING:
            log.add(measured, estimator.update(measured))
            last = measured.time
    return log.grasp(name)


def thinned(grasp: Grasp, every: int) -> Grasp:
    """A grasp of which every so manieth keyframe is kept: what it says roughly, in a fraction of the time."""
    return grasp._replace(keyframes=grasp.keyframes[::every], spacing=every * grasp.spacing)


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
        visual_correlation=frame.visual_correlation,
    )
