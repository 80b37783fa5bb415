# SPDX-License-Identifier: MIT
"""Visual poses that are nowhere near the truth: a wrong frame, quaternion or unit."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from ..trajectory import PoseTrajectory
from .evidence import Evidence
from .finding import Finding

if TYPE_CHECKING:
    from ...objects import ObjectModel

FAR = 0.05  # [m], a tracker that is so far off most of the time has lost the object
ADVICE = (
    "check their frame ('frame: camera' or 'world' in the topic map), camera_pose (x y z qx qy qz qw, "
    "qw last), and the unit (metres)"
)


def check_vision(evidence: Evidence) -> Iterator[Finding]:
    """Visual poses whose place is not the object's."""
    if evidence.object is not None:
        for sentence in visual_off_truth(evidence.vision, evidence.truth, evidence.object):
            topic = evidence.topics.vision.topic
            yield Finding("vision off the truth", sentence, "warning", topic)


def visual_off_truth(
    visual: PoseTrajectory | None,
    truth: PoseTrajectory | None,
    obj: ObjectModel,
    advice: str = ADVICE,
) -> list[str]:
    """A sentence where the object's centre is usually seen more than 5 cm from where it is.

    The rotations are compared up to the object's known symmetry, and only told: an object whose
    symmetry is not known may look the same turned.

    Args:
        visual: What the tracker reported, T_wo.
        truth: True poses T_wo.
        obj: The object.
        advice: What to check.
    """
    from ...metrics import rotation_error, translation_error

    if visual is None or truth is None:
        return []
    true = truth.at(visual.times)
    pairs = [
        (T, T_true) for T, T_true in zip(visual.poses, true, strict=True) if T_true is not None
    ]
    if not pairs:
        return []
    distance = np.median([translation_error(T, T_true, obj.center) for T, T_true in pairs])
    if not distance > FAR:
        return []
    angle = np.median([rotation_error(T, T_true, obj.symmetry) for T, T_true in pairs])
    return [
        f"visual poses are off the true ones by {distance * 1e3:.0f} mm and "
        f"{np.rad2deg(angle):.0f} degrees (medians); unless the tracker is that bad, {advice}"
    ]
