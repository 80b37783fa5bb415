# SPDX-License-Identifier: MIT
"""The problem set: an object in a hand of pads, as unrelated frames and as smooth tracked sequences.

The standard problem has the paper's size: 12 finger pads of 18 x 24 mm and 4 palm pads of 30 x 35 mm, which is 7,236
grid points, a 128^3 distance field, and 5 iterations. Everything comes from a seed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from vtgtsam import GridSdf, Pad

from .grasps import Grasp
from .motion import random_pose, turn, wander
from .problem import Problem

FINGER_PAD, PALM_PAD = (0.018, 0.024), (0.030, 0.035)  # [m]
TOUCH = 0.0005  # [m], a pad closer than this reports contact
RADIUS, HEIGHT = 0.033, 0.1  # [m], of a tomato can
HALF = 0.06  # [m], half the side of its grid


def standard_pads() -> list[Pad]:
    """The standard problem's 16 pads."""
    return [Pad(f"pad_{k}", FINGER_PAD if k < 12 else PALM_PAD) for k in range(16)]


def isyhand_pads() -> list[Pad]:
    """The built-in hand's own pads."""
    from vtgtsam import load_hand

    return list(load_hand("isyhand").pads)


def lump(resolution: int = 128, seed: int = 0) -> GridSdf:
    """Distance field of a can with dents: no symmetry, so that every direction can be observed."""
    rng = np.random.default_rng(seed)
    axis = np.linspace(-HALF, HALF, resolution)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij", sparse=True)
    side, end = np.hypot(x, y) - RADIUS, np.abs(z) - HEIGHT / 2
    distances = np.hypot(np.maximum(side, 0), np.maximum(end, 0))
    distances = distances + np.minimum(np.maximum(side, end), 0)
    for _ in range(4):
        (a, b, c), phase = rng.normal(0, 40, 3), rng.uniform(0, 2 * np.pi)
        distances += 0.001 * np.sin(a * x + b * y + c * z + phase)
    return GridSdf(distances, [-HALF] * 3, [HALF] * 3)


def single_frames(
    count: int,
    seed: int = 0,
    pads: Sequence[Pad] | None = None,
    sdf: GridSdf | None = None,
    **settings: Any,
) -> Problem:
    """Unrelated frames: each a new grasp, start and visual pose a few millimetres and degrees from the truth.

    Args:
        count: Number of frames.
        seed: Seed of everything random.
        pads: The hand's pads; the standard 16 where not given.
        sdf: The object's distance field; ``lump`` where not given.
        settings: Weights, losses, damping or iterations where not the default (see ``Problem``).
    """
    rng = np.random.default_rng(seed)
    pads = standard_pads() if pads is None else pads
    sdf = lump() if sdf is None else sdf
    T_true = np.stack([random_pose(rng, 1.0, 0.2) for _ in range(count)])
    T_op = []
    for _ in range(count):
        grasp = Grasp(rng, sdf, pads)
        T_op.append(grasp.closed(grasp.T_op, _gaps(rng, len(pads), 1)[0]))
    return _problem(
        grasp,
        T_true,
        np.stack(T_op),
        T_visual=np.stack([T @ random_pose(rng, 0.02, 0.0015) for T in T_true]),
        T_start=np.stack([T @ random_pose(rng, 0.02, 0.0015) for T in T_true]),
        settings=settings,
    )


def sequence(
    count: int,
    seed: int = 0,
    pads: Sequence[Pad] | None = None,
    sdf: GridSdf | None = None,
    **settings: Any,
) -> Problem:
    """A tracked grasp: the hand turns by a degree a frame, the object slips in it by 0.2 mm and 0.3 degrees.

    The pads stay in the hand but yield to the object, and contacts come and go. The visual pose is off by a slowly
    changing error and some noise. Arguments as for ``single_frames``.
    """
    rng = np.random.default_rng(seed)
    pads = standard_pads() if pads is None else pads
    grasp = Grasp(rng, lump() if sdf is None else sdf, pads)
    slip = wander(rng, count, 0.06, 0.0025)  # of the object in the hand
    gaps = _gaps(rng, len(pads), count)
    T_op = np.stack(
        [grasp.closed(np.linalg.inv(slip[n]) @ grasp.T_op, gaps[n]) for n in range(count)]
    )
    T_true = (
        random_pose(rng, 1.0, 0.2)
        @ turn(count, np.radians(1.0))
        @ random_pose(rng, 0.3, 0.02)
        @ slip
    )
    noise = np.stack([random_pose(rng, 0.003, 0.0003) for _ in range(count)])
    T_visual = T_true @ wander(rng, count, 0.02, 0.0015) @ noise
    return _problem(grasp, T_true, T_op, T_visual, T_visual, settings)


def _gaps(rng: np.random.Generator, pads: int, count: int) -> np.ndarray:
    """Distances of the pads from the object [m], shape (count, K): most touch, a quarter hang back."""
    back = rng.random(pads) < 0.25
    mean = np.where(back, rng.uniform(0.0005, 0.01, pads), 0.0)
    swing = np.where(back, 0.001, 0.0003)
    rate, phase = rng.uniform(0.05, 0.2, pads), rng.uniform(0, 2 * np.pi, pads)
    return np.asarray(mean + swing * np.sin(rate * np.arange(count)[:, None] + phase))


def _problem(
    grasp: Grasp,
    T_true: np.ndarray,
    T_op: np.ndarray,
    T_visual: np.ndarray,
    T_start: np.ndarray,
    settings: dict[str, Any],
) -> Problem:
    problem = Problem(
        values=grasp.sdf.values,
        lower=grasp.sdf.lower,
        upper=grasp.sdf.upper,
        points_p=np.concatenate([pad.points_p for pad in grasp.pads]),
        offsets=np.cumsum([0, *(len(pad.points_p) for pad in grasp.pads)]),
        T_wp=T_true[:, None] @ T_op,
        contacts=np.stack([grasp.distances(T) for T in T_op]) < TOUCH,
        T_visual=T_visual,
        T_true=T_true,
        T_start=T_start,
        w_vis=np.array([1.0, 1.0]),
    )
    return replace(problem, **settings)
