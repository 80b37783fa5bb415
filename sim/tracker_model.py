# SPDX-License-Identifier: MIT
"""A model of the errors of a learnt tracker such as FoundationPose. It is a model, not that tracker.

Such trackers need a GPU and weights that cannot be shipped. This puts errors of the kinds that are reported of them on
the true pose, so that one can see what fusion does with them; what a tracker of one's own does, only its poses tell
(``vtgtsam attach-vision``).

- jitter: 1 mm and 1 degree on each axis, each image anew (chosen);
- drift: 4.7 mm and 5 degrees where half of the object is covered, in proportion to what is covered. NeuralFeels
  (arXiv 2312.13469) reports average drifts of 4.7 mm in the hand, 2.3 mm with known shapes; that vision alone becomes
  worse under fingers is what V-HOP (arXiv 2502.17434) and FoundationPose's users (issues 119 and 325) report;
- a flip by 180 degrees about an axis, for 1 s (FoundationPose, issues 395 and 102);
- two drop-outs of 0.5 s, and silence where more than 90 % is covered;
- latency: a pose is known 100 ms after its image (about 30 Hz are reported on a desktop's GPU, a robot's is slower).

It says nothing of its own uncertainty, as FoundationPose does not (its issue 136).
"""

from __future__ import annotations

import gtsam
import numpy as np

from vtgtsam.camera import CameraIntrinsics
from vtgtsam.vision import ray_kernels
from vtgtsam.vision.alignment import Shape
from vtgtsam.vision.hand_mask import HandMask

from .calibration import random_direction
from .simulate import Trajectory
from .world import World

NAME = "learnt-model"
JITTER = np.repeat([np.deg2rad(1.0), 0.001], 3)  # [rad, m], of each axis
DRIFT = (np.deg2rad(5.0), 0.0047)  # [rad, m], where half of the object is covered
DRIFT_TIME = 2.0  # [s], in which a drift changes
FLIPS, FLIP_TIME = 1, 1.0  # how many, and how long one lasts [s]
DROPS, DROP_TIME = 2, 0.5  # the same of drop-outs
HIDDEN = 0.9  # covered by more, the object is not found
LATENCY = 0.1  # [s]
STRIDE = 4  # pixels, with which the covered share is measured


def poses(
    world: World,
    trajectory: Trajectory,
    camera: CameraIntrinsics,
    T_wc: gtsam.Pose3,
    rng: np.random.Generator,
) -> list[gtsam.Pose3 | None]:
    """The object in the camera that such a tracker might report for each image, None where it has lost it.

    Args:
        world: Hand and object.
        trajectory: What truly happened.
        camera: Intrinsics, for which part the hand covers.
        T_wc: The camera's true pose.
        rng: The same state gives the same errors.
    """
    T_co = [T_wc.between(gtsam.Pose3(T)) for T in trajectory.frame_T_wo]
    covered = covered_shares(world, trajectory, camera, T_wc, T_co)
    center_o = np.asarray(world.obj.center)
    return with_errors(T_co, covered, trajectory.frame_time, center_o, rng)


def with_errors(
    T_co: list[gtsam.Pose3],
    covered: np.ndarray,
    times: np.ndarray,
    center_o: np.ndarray,
    rng: np.random.Generator,
) -> list[gtsam.Pose3 | None]:
    """True poses with the model's errors, None where it has lost the object.

    Args:
        T_co: The object in the camera, for each image.
        covered: Share of the object that is covered there, shape (F,).
        times: Instants of the images [s], shape (F,).
        center_o: About which rotations are wrong [m], shape (3,), object frame.
        rng: The same state gives the same errors.
    """
    drift = _drift(times, rng)
    flipped = _spells(times, FLIPS, FLIP_TIME, rng)
    dropped = _spells(times, DROPS, DROP_TIME, rng)
    turn = gtsam.Rot3.Expmap(np.pi * np.eye(3)[rng.integers(3)])
    center = gtsam.Pose3(gtsam.Rot3(), center_o)
    found: list[gtsam.Pose3 | None] = []
    for k, T in enumerate(T_co):
        xi = covered[k] / 0.5 * drift[k] + JITTER * rng.standard_normal(6)
        at_center = gtsam.Pose3.Expmap(xi)
        if flipped[k]:
            at_center = gtsam.Pose3(turn, np.zeros(3)) * at_center
        lost = dropped[k] or covered[k] > HIDDEN
        found.append(None if lost else T * center * at_center * center.inverse())
    return found


def covered_shares(
    world: World,
    trajectory: Trajectory,
    camera: CameraIntrinsics,
    T_wc: gtsam.Pose3,
    T_co: list[gtsam.Pose3],
) -> np.ndarray:
    """Share of the object's outline before which the hand is, for each image, shape (F,)."""
    small, shape = camera.strided(STRIDE), Shape(world.obj.sdf)
    pixels = np.array([small.fx, small.fy, small.cx, small.cy])
    mask, depth = HandMask(world.hand), np.empty((small.height, small.width))
    shares = []
    for k, T in enumerate(T_co):
        T_oc = T.inverse()
        R_oc, t_oc = T_oc.rotation().matrix(), np.asarray(T_oc.translation())
        ray_kernels.render(*shape.grid, shape.box, pixels, R_oc, t_oc, depth)
        T_hc = gtsam.Pose3(trajectory.frame_T_wh[k]).between(T_wc)
        hand = mask.depth(small, T_hc, trajectory.frame_joints[k])
        outline = np.isfinite(depth)
        shares.append((hand < depth)[outline].mean() if outline.any() else 1.0)
    return np.array(shares)


def _drift(times: np.ndarray, rng: np.random.Generator) -> np.ndarray:
    """A slowly turning error of the sizes of ``DRIFT``, shape (F, 6)."""
    knots = np.arange(times[0], times[-1] + 2 * DRIFT_TIME, DRIFT_TIME)
    sizes = [[size * random_direction(rng) for size in DRIFT] for _ in knots]
    values = np.array(sizes).reshape(len(knots), 6)
    return np.column_stack([np.interp(times, knots, column) for column in values.T])


def _spells(times: np.ndarray, count: int, length: float, rng: np.random.Generator) -> np.ndarray:
    """Where one of ``count`` spells of a length [s] at random instants is, shape (F,)."""
    starts = rng.uniform(times[0] + 1.0, times[-1] - length, count)
    inside = (times[:, None] >= starts) & (times[:, None] < starts + length)
    return np.asarray(inside.any(axis=1))
