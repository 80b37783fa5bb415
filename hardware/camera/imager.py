# SPDX-License-Identifier: MIT
"""The left imager of a stereo camera: its depth as it was measured, and the infrared image of the same pixels.

Depth that is aligned to the colour image has the colour camera's pixels, which no infrared image has.
"""

from __future__ import annotations

from dataclasses import dataclass

import gtsam
import numpy as np

from vtgtsam.camera import CameraIntrinsics


@dataclass(frozen=True, eq=False)
class LeftImager:
    """Where the left imager is and how it sees.

    Attributes:
        intrinsics: Of both its images.
        T_cd: Its pose in the colour camera's frame; d is the frame of depth as it was measured.
    """

    intrinsics: CameraIntrinsics
    T_cd: gtsam.Pose3


@dataclass(frozen=True, eq=False)
class LeftImages:
    """What it sees in one instant.

    Attributes:
        depth: Depth along its optical axis [m], shape (H, W), float32, 0 where nothing was measured.
        infrared: The infrared image, shape (H, W), uint8, or None where none of that instant came.
    """

    depth: np.ndarray
    infrared: np.ndarray | None
