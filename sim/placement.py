# SPDX-License-Identifier: MIT
"""Where the object starts: the two datasets of the paper ("Datasets").

``vary`` samples the object's orientation uniformly and drops it from a random height above the middle of
the palm. ``occ`` starts from a pose in which the object lies stably and the hand closes well around it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial.transform import Rotation

from vtgtsam.grasp import GraspDescription

if TYPE_CHECKING:
    import trimesh

CLEARANCE = 0.001  # [m], between palm and object where the height offset is zero
MAX_YAW = np.deg2rad(5.0)  # [rad], perturbation of the occ poses (paper)


def vary(
    description: GraspDescription, mesh: trimesh.Trimesh, rng: np.random.Generator
) -> np.ndarray:
    """A start pose T_wo, shape (4, 4), of the dataset ``vary``."""
    R_wo = Rotation.random(random_state=rng).as_matrix()
    height = rng.uniform(0.0, min(mesh.extents) / 2)
    return above_palm(description, mesh, R_wo, height)


def occ(T_wo: np.ndarray, mesh: trimesh.Trimesh, rng: np.random.Generator) -> np.ndarray:
    """A start pose of the dataset ``occ``: ``T_wo`` turned about the vertical by up to 5 degrees."""
    return turned(T_wo, mesh, rng.uniform(-MAX_YAW, MAX_YAW))


def turned(T_wo: np.ndarray, mesh: trimesh.Trimesh, yaw: float) -> np.ndarray:
    """A pose turned about the vertical through the object's middle by ``yaw`` [rad].

    The object is also lifted a little, so that it is clear of what it lay on.
    """
    R = Rotation.from_euler("z", yaw).as_matrix()
    center_o = mesh.bounds.mean(axis=0)
    T = T_wo.copy()
    T[:3, :3] = R @ T_wo[:3, :3]
    T[:3, 3] += (T_wo[:3, :3] - T[:3, :3]) @ center_o
    T[2, 3] += 2 * CLEARANCE
    return T


def above_palm(
    description: GraspDescription, mesh: trimesh.Trimesh, R_wo: np.ndarray, height: float = 0.0
) -> np.ndarray:
    """The pose of an object of orientation ``R_wo`` (3, 3) that hangs ``height`` [m] over the palm.

    The middle of its bounding box, as oriented, lies over the palm's centre.
    """
    corners = mesh.vertices @ R_wo.T
    lower, upper = corners.min(axis=0), corners.max(axis=0)
    palm_w = description.palm.level() @ description.palm.center
    T_wo = np.eye(4)
    T_wo[:3, :3] = R_wo
    T_wo[:2, 3] = palm_w[:2] - (lower + upper)[:2] / 2
    T_wo[2, 3] = palm_w[2] - lower[2] + CLEARANCE + height
    return T_wo
