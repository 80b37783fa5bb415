# SPDX-License-Identifier: MIT
"""The tracker of a run, and which of the camera's images it is given."""

from __future__ import annotations

from hardware.camera.camera import Camera
from hardware.camera.imager import LeftImager
from vtgtsam.vision.depth_tracker import DepthTracker, make_tracker
from vtgtsam.vision.hand_back import BACK

from .plan import Plan

SEES_OUTLINES = "depth-hand"  # the form that looks at infrared images


def run_tracker(plan: Plan, camera: Camera) -> tuple[DepthTracker, LeftImager | None]:
    """The tracker, and the left imager whose images it is given; None where it is given those of the colour camera.

    Args:
        plan: Names the tracker.
        camera: Its camera.
    """
    form = plan.tracker.removesuffix(BACK)
    imager = camera.left if form == SEES_OUTLINES else None
    intrinsics = camera.intrinsics if imager is None else imager.intrinsics
    return make_tracker(form, plan.obj, intrinsics, plan.hand), imager
