# SPDX-License-Identifier: MIT
"""What the estimator is told each frame, whoever tells it: simulator, hardware or file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import gtsam
import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike


@dataclass(frozen=True, eq=False)
class Measurement:
    """One frame's measurements.

    Attributes:
        time: Instant of the frame [s].
        contacts: Contact bit of each pad, shape (K,) in the hand's ``pad_names`` order, or a mapping
            from pad name to bit that names every pad.
        joints: Joint angles [rad], a mapping from joint name (other names are ignored) or an array
            in the hand's ``joint_names`` order. None where ``T_wp`` is given.
        T_wo_visual: The object's pose in the world as the visual tracker reports it, or None where
            it reports nothing this frame.
        T_wh: Pose of the hand's root frame in the world. Where it is None, a hand with joints stands at the world's
            origin, and one with pad poses moves with them: by the rigid motion that fits all pads best between two
            frames.
        T_wp: Poses of the pads in the world, shape (K, 4, 4). Where given, ``joints`` are not used.
        visual_sigma: Standard deviation of the visual pose, (rotation [rad], translation [m]), two positive
            numbers. Replaces the configured visual weight by 1/sigma^2 for this frame.
        visual_covariance: Covariance of the visual pose, shape (6, 6), right perturbation, rotation [rad]
            first, then translation [m]. Takes the weight's place where the configuration says
            ``use_visual_covariance`` and no ``visual_sigma`` is given.
        visual_time: Instant of the image that the visual pose is from [s]; ``time`` where None. A pose that is late is
            fused at its own instant, up to half a second back.
        visual_correlation: How long the visual pose's errors stay alike [s]; 0 where each pose errs by itself. Memory
            counts the poses of so long a time as one (``memory``); without memory it changes nothing.
    """

    time: float
    contacts: ArrayLike | Mapping[str, bool]
    joints: ArrayLike | Mapping[str, float] | None = None
    T_wo_visual: gtsam.Pose3 | None = None
    T_wh: gtsam.Pose3 | None = None
    T_wp: np.ndarray | None = None
    visual_sigma: tuple[float, float] | None = None
    visual_covariance: np.ndarray | None = None
    visual_time: float | None = None
    visual_correlation: float = 0.0
