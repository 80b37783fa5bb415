# SPDX-License-Identifier: MIT
"""Poses in which an object lies stably in the open hand and the closed hand covers it well.

The paper does not say how it chose them for its second dataset; here they are searched. The object is
put on the palm with each of its axes up and down at several yaw angles, and of the grasps that hold the
one that touches the most pads wins. Nothing in the search is random, and its result is kept in the cache.
"""

from __future__ import annotations

import hashlib

import numpy as np
from scipy.spatial.transform import Rotation

from vtgtsam.cache import cached_arrays
from vtgtsam.mesh.reading import sha256_of
from vtgtsam.objects import mesh_of

from . import constants as c
from .placement import MAX_YAW, above_palm, turned
from .simulate import Rejected, Trajectory, simulate
from .world import World

MAX_LIFT = 0.04  # [m], higher up only the thumb is in the way
YAWS = np.deg2rad(np.arange(0, 180, 45))  # [rad]
_VERSION = "2"  # raise when the search is to give other poses


def power_grasp(world: World) -> np.ndarray | None:
    """The object's pose T_wo, shape (4, 4), at rest in the open hand; None where no grasp holds."""
    text = world.description.model_dump_json() + world.hand.xml + _VERSION
    text += f"{world.model.opt.impratio:g}"
    key = hashlib.sha256(text.encode()).hexdigest()[:16]
    mesh = mesh_of(world.obj)
    key += "-" + sha256_of(mesh.vertices, mesh.faces)[:32]
    found = cached_arrays("grasps", key, lambda: {"T_wo": _search(world)})["T_wo"]
    return found if len(found) else None


def _search(world: World) -> np.ndarray:
    best, best_score = np.empty((0, 4)), 0.0
    for R_wo in _orientations():
        try:
            trajectory = simulate(world, _lowest(world, R_wo))
        except Rejected:
            continue
        rest, score = trajectory.T_wo[0], _coverage(trajectory)
        if score > best_score and _has_room(world, rest):
            best, best_score = rest, score
    return best


def _has_room(world: World, T_wo: np.ndarray) -> bool:
    """Whether the object is clear of the hand wherever the dataset ``occ`` turns it to."""
    for yaw in np.linspace(-MAX_YAW, MAX_YAW, 5):
        world.place(turned(T_wo, world.obj.mesh, yaw))
        if world.overlap_with_hand() > 0.0:
            return False
    return True


def _lowest(world: World, R_wo: np.ndarray) -> np.ndarray:
    """The lowest pose above the palm in which the object of that orientation is clear of the hand.

    Long objects lie on the fingers, which are bent a little.
    """
    for height in np.arange(0.0, MAX_LIFT, 0.002):
        T_wo = above_palm(world.description, world.obj.mesh, R_wo, height)
        world.place(T_wo)
        if world.overlap_with_hand() == 0.0:
            return T_wo
    raise Rejected("does not fit into the open hand")


def _orientations() -> list[np.ndarray]:
    """Each of the object's axes up and down, each at several yaw angles."""
    upright = [Rotation.from_euler("x", angle) for angle in (0, np.pi / 2, np.pi, -np.pi / 2)]
    upright += [Rotation.from_euler("y", angle) for angle in (np.pi / 2, -np.pi / 2)]
    yaws = [Rotation.from_euler("z", yaw) for yaw in YAWS]
    return [(yaw * up).as_matrix() for up in upright for yaw in yaws]


def _coverage(trajectory: Trajectory) -> float:
    """Mean number of pads touched from before the turn to the end."""
    return float(trajectory.contacts[trajectory.time >= c.TURN_START].sum(axis=1).mean())
