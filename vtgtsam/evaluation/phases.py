# SPDX-License-Identifier: MIT
"""Before and after the hand has turned: occlusion is mild in the one and strong in the other.

In the paper's sequences the hand grasps the object, is turned back by 45 degrees so that its fingers hide
the object from the camera, and rests again (section IV-B). The hand's recorded poses tell when.
"""

from __future__ import annotations

from collections.abc import Sequence

import gtsam
import numpy as np

from ..measurement import Measurement

BEFORE, TURNING, AFTER = "before", "turning", "after"

AT_REST = np.radians(2.0)  # [rad], the hand has left, or reached, a resting orientation
TURNED = np.radians(10.0)  # [rad], less than this between start and end is no turn


def phases_of(frames: Sequence[Measurement]) -> list[str]:
    """The phase of each measurement; a hand whose pose is not given stands at the world's origin."""
    return turn_phases([frame.T_wh or gtsam.Pose3() for frame in frames])


def turn_phases(T_wh: Sequence[gtsam.Pose3]) -> list[str]:
    """The phase of each frame: "before", "turning" or "after".

    "before" lasts until the hand is first more than 2 degrees from its first orientation, "after" begins
    once it stays within 2 degrees of its last one. A hand whose last orientation is less than 10 degrees
    from its first has not turned: all frames are "before".
    """
    if not T_wh:
        return []
    from_start = _angles(T_wh, T_wh[0])
    if from_start[-1] < TURNED:
        return [BEFORE] * len(T_wh)
    start = int(np.argmax(from_start > AT_REST))
    end = int(np.flatnonzero(_angles(T_wh, T_wh[-1]) > AT_REST)[-1]) + 1
    return [BEFORE] * start + [TURNING] * (end - start) + [AFTER] * (len(T_wh) - end)


def _angles(poses: Sequence[gtsam.Pose3], reference: gtsam.Pose3) -> np.ndarray:
    """Rotation angle between each pose and the reference [rad], shape (N,)."""
    rotation = reference.rotation()
    return np.array([np.linalg.norm(rotation.logmap(T.rotation())) for T in poses])
