# SPDX-License-Identifier: MIT
r"""Hand the fused pose back to a visual tracker that has lost itself.

A tracker goes on from its own last pose. Where that is lost, or on another part of the image, touch and memory often
still know where the object is. So after each frame

    tracker.search_at(T_wo)        where ``pose_to_search_at(estimate, T_wh)`` is a pose

and the tracker looks there, too, in its next image. It moves where the tracker searches, never what it measures: a
pose that the images do not show is not reported, and neither pose nor covariance may hold anything of the hint.
Otherwise touch would be counted twice, once in the hint and once in the fusion.
"""

from __future__ import annotations

from typing import Protocol, runtime_checkable

import gtsam
import numpy as np

from ..estimate import Estimate

BACK = "+back"  # in the name of a tracker that was handed fused poses
REFUSED = 0.1  # visual weight below which the tracker's pose is not believed
KNOWN = 0.005  # [m], standard deviation of a position that is worth searching at
KNOWN_ANGLE = 0.2  # [rad]


@runtime_checkable
class Searches(Protocol):
    """A visual tracker that can be told where to look."""

    def search_at(self, T_wo: gtsam.Pose3) -> None:
        """Look for the object near this pose, too, in the next image."""
        ...


class HandBack:
    """Decides after each frame whether the tracker is to be told where the object is.

    Args:
        tracker: The tracker to tell.
    """

    def __init__(self, tracker: Searches) -> None:
        self._tracker = tracker

    def after(self, estimate: Estimate) -> gtsam.Pose3 | None:
        """Tell the tracker, where it needs it, and return what it was told."""
        T_wo = pose_to_search_at(estimate)
        if T_wo is not None:
            self._tracker.search_at(T_wo)
        return T_wo


def pose_to_search_at(estimate: Estimate) -> gtsam.Pose3 | None:
    """The fused pose T_wo, where the tracker reported none or one that is not believed, and we know better.

    None where the tracker is believed, or where nobody knows the pose well enough.
    """
    if estimate.T_wo is None or estimate.visual_weight >= REFUSED:
        return None
    return estimate.T_wo if _is_known(estimate.covariance) else None


def _is_known(covariance: np.ndarray) -> bool:
    if not np.isfinite(covariance).all():
        return False
    rotation, translation = (
        np.sqrt(np.linalg.eigvalsh(part)[-1]) for part in (covariance[:3, :3], covariance[3:, 3:])
    )
    return bool(rotation < KNOWN_ANGLE and translation < KNOWN)
