# SPDX-License-Identifier: MIT
"""How far an estimated object pose is from the true one.

ADD-S is the paper's (section IV): the mean distance of the object's vertices at the estimate to its
surface at the truth. The surface is the triangles, not the vertices as in BOP's ADD-S (ADI).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import gtsam
import igl
import numpy as np

if TYPE_CHECKING:
    import trimesh


def adds(mesh: trimesh.Trimesh, T_est: gtsam.Pose3, T_true: gtsam.Pose3) -> float:
    """ADD-S [m]: mean distance of the vertices at ``T_est`` to the surface at ``T_true``."""
    vertices = np.asarray(mesh.vertices, dtype=np.float64)
    moved = T_true.between(T_est).transformFrom(vertices.T).T
    squared, _, _ = igl.point_mesh_squared_distance(
        np.ascontiguousarray(moved), vertices, np.asarray(mesh.faces, dtype=np.int64)
    )
    return float(np.sqrt(squared).mean())


def add(mesh: trimesh.Trimesh, T_est: gtsam.Pose3, T_true: gtsam.Pose3) -> float:
    """ADD [m]: mean distance of each vertex at ``T_est`` to the same vertex at ``T_true``."""
    vertices = np.asarray(mesh.vertices, dtype=np.float64)
    apart = T_est.transformFrom(vertices.T) - T_true.transformFrom(vertices.T)
    return float(np.linalg.norm(apart, axis=0).mean())


def translation_error(T_est: gtsam.Pose3, T_true: gtsam.Pose3, center_o: np.ndarray) -> float:
    """Distance [m] of the object's centre ``center_o`` (3,) at the two poses."""
    return float(np.linalg.norm(T_est.transformFrom(center_o) - T_true.transformFrom(center_o)))
