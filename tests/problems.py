# SPDX-License-Identifier: MIT
"""Small random frames with a ball, a box or a bumpy lump, and pads around it."""

import gtsam
import numpy as np
from reference import Problem, exp_se3

from vtgtsam import EstimatorConfig, GridSdf, Measurement, ObjectModel, Pad, PadSet

HALF = 0.06  # [m], half the side of the grids


def grid_points(resolution):
    axis = np.linspace(-HALF, HALF, resolution)
    return np.stack(np.meshgrid(axis, axis, axis, indexing="ij"), axis=-1)


def ball_sdf(radius=0.03, resolution=48):
    distances = np.linalg.norm(grid_points(resolution), axis=-1) - radius
    return GridSdf(distances, [-HALF] * 3, [HALF] * 3)


def box_sdf(half=(0.02, 0.03, 0.04), resolution=48):
    q = np.abs(grid_points(resolution)) - np.array(half)
    outside = np.linalg.norm(np.maximum(q, 0), axis=-1)
    return GridSdf(outside + np.minimum(q.max(axis=-1), 0), [-HALF] * 3, [HALF] * 3)


def lump_sdf(seed, resolution=48):
    """A ball with a few random dents: no symmetry, every direction can be observed."""
    rng = np.random.default_rng(seed)
    points = grid_points(resolution)
    distances = np.linalg.norm(points / [1.0, 0.8, 1.2], axis=-1) - 0.03
    for _ in range(4):
        wave, phase = rng.normal(0, 60, 3), rng.uniform(0, 2 * np.pi)
        distances = distances + 0.002 * np.sin(points @ wave + phase)
    return GridSdf(distances, [-HALF] * 3, [HALF] * 3)


def pads_around(seed, count=8, distance=0.03, size=(0.014, 0.018)):
    """A PadSet and pad poses (K, 4, 4) facing the origin from random sides."""
    rng = np.random.default_rng(seed)
    T_wp = np.tile(np.eye(4), (count, 1, 1))
    for k in range(count):
        direction = rng.normal(size=3)
        direction /= np.linalg.norm(direction)
        side = np.cross(direction, rng.normal(size=3))
        side /= np.linalg.norm(side)
        T_wp[k, :3, :3] = np.column_stack([side, np.cross(-direction, side), -direction])
        T_wp[k, :3, 3] = direction * distance * rng.uniform(0.95, 1.1)
    return PadSet(Pad(f"pad_{k}", size) for k in range(count)), T_wp


def random_pose(rng, rotation=0.1, translation=0.003):
    return exp_se3(np.concatenate([rng.normal(0, rotation, 3), rng.normal(0, translation, 3)]))


def frame(seed, sdf=None, count=8):
    """(PadSet, ObjectModel, Measurement, start pose) of one random frame."""
    rng = np.random.default_rng(seed)
    sdf = lump_sdf(seed) if sdf is None else sdf
    pads, T_wp = pads_around(seed, count)
    T_wh = random_pose(rng, 1.0, 0.3)  # away from the world's origin
    start, visual = T_wh @ random_pose(rng), T_wh @ random_pose(rng)
    measurement = Measurement(
        time=0.0,
        contacts=rng.random(count) < 0.6,
        T_wo_visual=gtsam.Pose3(visual),
        T_wp=T_wh @ T_wp,
    )
    return pads, ObjectModel("lump", sdf), measurement, start


def as_reference(pads, obj, measurement, config):
    """The same frame for the independent implementation."""
    return Problem(
        values=obj.sdf.values,
        lower=obj.sdf.lower,
        upper=obj.sdf.upper,
        pads=[pad.points_p for pad in pads.pads],
        T_wp=measurement.T_wp,
        contacts=np.asarray(measurement.contacts),
        T_visual=measurement.T_wo_visual.matrix(),
        w_vis=tuple(config.visual_weights),
        w_tac=config.w_tac,
        w_pen=config.w_pen,
        log_theta_vis=config.log_theta_vis,
        log_theta_tac=config.log_theta_tac,
    )


def alone(**overrides):
    """The recommended settings for a frame by itself, and for a robot that is perfectly calibrated."""
    exact = {"joint_sigma": 0.0, "camera_sigma": (0.0, 0.0), "pad_sigma": 0.0}
    return EstimatorConfig(**({"method": "vis+tac+pen"} | exact | overrides))
