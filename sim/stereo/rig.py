# SPDX-License-Identifier: MIT
"""Where a D435's imagers, projector and colour camera are, and their numbers.

The depth image is the left imager's; its frame is the stereo camera's (x right, y down, z forward).
"""

from __future__ import annotations

import gtsam
import numpy as np

from vtgtsam.camera import CameraIntrinsics

BASELINE = 0.050  # [m], left to right imager (D400 series datasheet)
PROJECTOR = 0.028  # [m], left imager to projector, 29 mm to within the housing's tolerance (same)
COLOR = -0.015  # [m], left imager to colour camera (same)

# The resolution at which Intel says that a D435 measures best; 90 degrees wide: f = 424 / tan(45 deg).
INFRARED = CameraIntrinsics(width=848, height=480, fx=424.0, fy=424.0, cx=423.5, cy=239.5)
DISPARITIES = 80  # [pixels] searched: nearest depth 424 * 0.05 / 80 = 0.265 m
DISPARITY_STEP = 1 / 32  # [pixels], the D400's own resolution


def beside(T_wc: gtsam.Pose3, x: float) -> gtsam.Pose3:
    """The pose of a part of the camera ``x`` [m] to the right of the left imager, looking the same way."""
    return T_wc * gtsam.Pose3(gtsam.Rot3(), np.array([x, 0.0, 0.0]))
