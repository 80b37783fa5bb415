# SPDX-License-Identifier: MIT
"""What a live run is to do."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import gtsam

from vtgtsam import Calibration, EstimatorConfig, HandModel, ObjectModel
from vtgtsam.grasp import GraspDescription
from vtgtsam.live.view import Where

from .ages import GIVE_UP


@dataclass(frozen=True, eq=False)
class Plan:
    """What to do.

    Attributes:
        hand: Its model.
        grasp: How it closes.
        obj: The object.
        config: The estimator's settings.
        T_ho: The object's first pose in the hand frame; None: the camera finds it.
        tracker: Form of the visual tracker, "depth" or "depth-hand"; with "+back" it is handed fused poses.
        record: The file to record to, or None.
        images: Whether the recording has the images.
        seconds: How long to run after the grasp has begun [s]; None: until it is ended from outside.
        ends_after_grasp: Whether to end when the hand has closed, and held for a moment.
        give_up: How long joints or pads may be silent before the run ends [s].
        view: Where to show the run in Rerun, or None.
        calibration: What is known of the robot's camera and joints, or None.
        calibrate: Whether to find out more while it works.
        calibration_out: The file to write that to when the run ends, or None.
    """

    hand: HandModel
    grasp: GraspDescription
    obj: ObjectModel
    config: EstimatorConfig
    T_ho: gtsam.Pose3 | None = None
    tracker: str = "depth-hand"
    record: Path | None = None
    images: bool = True
    seconds: float | None = None
    ends_after_grasp: bool = False
    give_up: float = GIVE_UP
    view: Where | None = None
    calibration: Calibration | None = None
    calibrate: bool = False
    calibration_out: Path | None = None
