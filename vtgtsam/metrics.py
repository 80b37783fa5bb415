# SPDX-License-Identifier: MIT
"""How far an estimated object pose is from the true one.

ADD-S is the paper's (section IV): the mean distance of the object's vertices at the estimate to its
surface at the truth. The surface is the triangles; BOP's ADD-S (ADI) measures to the nearest vertex
instead and never comes out as zero between two poses that a symmetry makes equal.
"""

from __future__ import annotations

from collections import OrderedDict
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import gtsam
    import trimesh


def adds(mesh: trimesh.Trimesh, T_est: gtsam.Pose3, T_true: gtsam.Pose3) -> float:
    """ADD-S [m]: mean distance of the vertices at ``T_est`` to the surface at ``T_true``.

    Exact to rounding. The first call with a mesh sorts its triangles (10 ms), later ones take one or
    two milliseconds.
    """
    return _prepared(mesh)(T_est, T_true)


class Adds:
    """ADD-S of one mesh for many pairs of poses."""

    def __init__(self, mesh: trimesh.Trimesh) -> None:
        from .surface import Surface

        self._vertices = np.array(mesh.vertices, dtype=np.float64)
        self._surface = Surface(self._vertices, mesh.faces)
        # The triangle nearest to each vertex last time: a good start, whatever the pose now. Threads
        # may share it, since every start gives the same distance.
        self._start = np.zeros(len(self._vertices), dtype=np.int64)

    def __call__(self, T_est: gtsam.Pose3, T_true: gtsam.Pose3) -> float:
        """ADD-S [m] of two poses; NaN where one of them is not finite."""
        moved = _placed(self._vertices, T_true.between(T_est))
        return float(self._surface.distances(moved, self._start).mean())


def add(mesh: trimesh.Trimesh, T_est: gtsam.Pose3, T_true: gtsam.Pose3) -> float:
    """ADD [m]: mean distance of each vertex at ``T_est`` to the same vertex at ``T_true``."""
    vertices = np.asarray(mesh.vertices, dtype=np.float64)
    apart = _placed(vertices, T_true.between(T_est)) - vertices
    return float(np.linalg.norm(apart, axis=1).mean())


def translation_error(T_est: gtsam.Pose3, T_true: gtsam.Pose3, center_o: np.ndarray) -> float:
    """Distance [m] between the places of the object's centre ``center_o`` (3,) [m] at the two poses."""
    return float(np.linalg.norm(T_est.transformFrom(center_o) - T_true.transformFrom(center_o)))


def rotation_error(
    T_est: gtsam.Pose3, T_true: gtsam.Pose3, symmetry: dict[str, Any] | None = None
) -> float:
    """Smallest angle [rad] that turns the estimate into the truth or into one that looks the same.

    Args:
        T_est: Estimated pose.
        T_true: True pose.
        symmetry: The object's entry of BOP's ``models_info.json``, or None. About two axes that are
            not parallel the object is a ball, and the error is 0.
    """
    between = T_est.rotation().between(T_true.rotation()).matrix()
    axes = [np.asarray(a["axis"], float) for a in (symmetry or {}).get("symmetries_continuous", [])]
    turns = [np.eye(3)]
    turns += [
        np.reshape(s, (4, 4))[:3, :3] for s in (symmetry or {}).get("symmetries_discrete", [])
    ]
    if any(np.linalg.norm(np.cross(axes[0], axis)) > 1e-6 for axis in axes[1:]):
        return 0.0
    if axes:
        axis = axes[0] / np.linalg.norm(axes[0])
        # With every turn about the axis allowed, what remains is how far the axis itself is off.
        return min(_angle_between(between @ turn @ axis, axis) for turn in turns)
    return min(_angle(between @ turn) for turn in turns)


def _angle(R: np.ndarray) -> float:
    """Angle of a rotation [rad]; from sine and cosine, since the cosine alone loses small ones."""
    sine = np.linalg.norm([R[2, 1] - R[1, 2], R[0, 2] - R[2, 0], R[1, 0] - R[0, 1]])
    return float(np.arctan2(sine, np.trace(R) - 1))


def _angle_between(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.arctan2(np.linalg.norm(np.cross(a, b)), a @ b))


def _placed(points: np.ndarray, pose: gtsam.Pose3) -> np.ndarray:
    return points @ pose.rotation().matrix().T + pose.translation()


_KEPT = 16  # meshes
_ready: OrderedDict[tuple[int, int], Adds] = OrderedDict()


def _prepared(mesh: trimesh.Trimesh) -> Adds:
    """The metric of a mesh, kept from the last call unless its vertices or faces have changed."""
    key = (hash(mesh.vertices), hash(mesh.faces))  # trimesh hashes the contents, and only once
    if key not in _ready:
        while len(_ready) >= _KEPT:
            _ready.popitem(last=False)
        _ready[key] = Adds(mesh)
    _ready.move_to_end(key)
    return _ready[key]
