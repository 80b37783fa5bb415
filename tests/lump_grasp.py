# SPDX-License-Identifier: MIT
"""A hand with an object in it, seen by a tracker, for the tests of memory and of faults."""

import gtsam
import numpy as np
from problems import lump_sdf, pads_around

from vtgtsam import EstimatorConfig, Measurement, ObjectModel, PoseEstimator
from vtgtsam.sdf.search import ClosestPoints

PERIOD = 1 / 30
SEEN = (0.02, 0.002)  # [rad], [m] of the tracker


def turn(angle):
    """A hand whose wrist turns about a point a hand's length away."""
    about = gtsam.Pose3(gtsam.Rot3(), np.array([0.1, 0.0, 0.0]))
    turned = gtsam.Pose3(gtsam.Rot3.Rz(angle), np.zeros(3))
    return about.compose(turned).compose(about.inverse())


def grasp(count=90, noise=1.0, seed=0, turning=0.0, away=0.0):
    """(pads, object, measurements, true poses) of a lump that 12 pads hold, or stand ``away`` [m] from.

    The hand turns at ``turning`` [rad/s].
    """
    rng = np.random.default_rng(seed)
    pads, T_hp = pads_around(1, count=12)
    obj = ObjectModel("lump", lump_sdf(1, 64))
    everything = np.ones(12, dtype=bool)
    closest = ClosestPoints(pads, obj.sdf)
    for _ in range(20):  # until the pads touch, along their own normals
        gaps = closest.search(np.eye(4), T_hp, everything).distances
        T_hp[:, :3, 3] += gaps[:, None] * T_hp[:, :3, 2]
    T_hp[:, :3, 3] -= away * T_hp[:, :3, 2]
    frames, truth = [], []
    for n in range(count):
        T_wh = turn(turning * n * PERIOD)
        xi = noise * rng.normal(size=6) * np.repeat(SEEN, 3)
        frames.append(
            Measurement(
                time=n * PERIOD,
                contacts=everything,
                T_wp=T_wh.matrix() @ T_hp,
                T_wh=T_wh,
                T_wo_visual=T_wh.retract(xi),
                visual_sigma=SEEN,
            )
        )
        truth.append(T_wh)
    return pads, obj, frames, truth


def errors(estimates, truth):
    """Distance of each estimate from the truth [m]."""
    return np.array(
        [
            np.linalg.norm(e.T_wo.translation() - T.translation())
            for e, T in zip(estimates, truth, strict=True)
        ]
    )


def run(pads, obj, frames, **settings):
    settings = {"pad_sigma": 0.0, "camera_sigma": (0.0, 0.0)} | settings
    estimator = PoseEstimator(pads, obj, EstimatorConfig(**settings))
    return [estimator.update(frame) for frame in frames]
