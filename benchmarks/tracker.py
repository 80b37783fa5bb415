# SPDX-License-Identifier: MIT
"""How long the visual tracker takes for an image, by camera, and by what it is given: depth, the hand, infrared.

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
    words = "Running time of an image from the 31st on, and how many a second by the median.\n\n"
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
    """Running times of each form's images [s]; of the one that knows the hand with the infrared images, too."""
    trajectory, video = take.trajectory, take.video
    forms = [(form, False) for form in FORMS]
    if next(video.infrared(take.noise)) is not None:
        forms.append((FORMS[-1], True))
    trackers = [
        make_tracker(form, take.world.obj, video.camera, take.world.hand) for form, _ in forms
    ]
    for tracker in trackers:
        tracker.start(take.T_wo_registered)
    times: list[list[float]] = [[] for _ in forms]
    images = zip(video.images(take.noise, take.error), video.infrared(take.noise), strict=True)
    for k, (depth, infrared) in enumerate(images):
        joints, T_wh = trajectory.frame_joints[k], gtsam.Pose3(trajectory.frame_T_wh[k])
        for (_, sees), tracker, of_form in zip(forms, trackers, times, strict=True):
            beside = infrared if sees else None
            time, _ = timed(partial(tracker.update, depth, take.T_wc, joints, T_wh, beside))
            of_form.append(time.cpu)
    names = [f"{form}, infrared" if sees else form for form, sees in forms]
    return {name: np.array(of_form[WARM:]) for name, of_form in zip(names, times, strict=True)}


def _figures(seconds: np.ndarray) -> dict[str, float]:
    median, slow = np.quantile(seconds, (0.5, 0.99))
    return {"median [ms]": 1e3 * median, "99 % [ms]": 1e3 * slow, "images a second": 1.0 / median}
