# SPDX-License-Identifier: MIT
"""How long the visual tracker takes for an image, with either camera, with and without the hand's geometry.

The images of a simulated grasp are made beforehand. Its trackers then take turns, image by image, on one core; each
image counts with the time for which the tracker's thread was running.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from typing import Any

import gtsam
import numpy as np

from sim.calibration import CalibrationError
from sim.observe import Noise
from sim.record import Take
from sim.sequence import SequenceName, Settings, film, make_trajectory
from vtgtsam.vision.depth_tracker import FORMS, make_tracker

from .clock import pin, timed
from .report import save, table

OBJECTS = ("can", "banana", "cube")
CAMERAS = ("paper", "stereo")
WARM = 30  # images that do not count: code is loaded, noise is learnt


def run(objects: Sequence[str] = OBJECTS) -> None:
    """Measure, and write ``tracker.md`` and ``tracker.json``."""
    rows = [row for name in objects for row in measure(name)]
    words = "Running time of an image [ms]; of the images that the tracker had a pose in, and how many a second.\n\n"
    save("tracker", words + table(rows), {"rows": rows}, {})


def measure(object_name: str) -> list[dict[str, Any]]:
    """A row a camera and form of the tracker."""
    world, trajectory = make_trajectory(Settings("vary"), SequenceName(object_name, 0))
    error = CalibrationError.none(len(world.hand.joint_names))
    pin()
    rows = []
    for camera in CAMERAS:
        video, noise = film(camera, world, trajectory), Noise(1.0, np.random.SeedSequence(0))
        take = Take(world, trajectory, video, noise, error, gtsam.Pose3())
        rows += [
            {"object": object_name, "camera": camera, "tracker": form} | _figures(times)
            for form, times in _by_form(take).items()
        ]
    return rows


def _by_form(take: Take) -> dict[str, np.ndarray]:
    """Running times of each form's images [s]."""
    trajectory = take.trajectory
    trackers = {
        form: make_tracker(form, take.world.obj, take.video.camera, take.world.hand)
        for form in FORMS
    }
    for tracker in trackers.values():
        tracker.start(take.T_wo_registered)
    times: dict[str, list[float]] = {form: [] for form in FORMS}
    for k, image in enumerate(take.video.images(take.noise, take.error)):
        joints, T_wh = trajectory.frame_joints[k], gtsam.Pose3(trajectory.frame_T_wh[k])
        for form, tracker in trackers.items():
            time, _ = timed(partial(tracker.update, image, take.T_wc, joints, T_wh))
            times[form].append(time.cpu)
    return {form: np.array(of_form[WARM:]) for form, of_form in times.items()}


def _figures(seconds: np.ndarray) -> dict[str, float]:
    median, slow = np.quantile(seconds, (0.5, 0.99))
    return {"median [ms]": 1e3 * median, "99 % [ms]": 1e3 * slow, "images a second": 1.0 / median}
