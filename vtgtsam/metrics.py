# SPDX-License-Identifier: MIT
"""How far an estimated object pose is from the true one.

ADD-S is the paper's (section IV): the mean distance of the object's vertices at the estimate to its
surface at the truth. The surface is the triangles; BOP's ADD-S (ADI) measures to the nearest vertex
instead and never comes out as zero between two poses that a symmetry makes equal.

All errors depend on T_true^-1 T_est alone: what is measured for many pairs of poses takes these as rows
(R | t), shape (N, 3, 4), as ``relative_poses`` makes them.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    import gtsam
    import trimesh


def adds(mesh: trimesh.Trimesh, T_est: gtsam.Pose3, T_true: gtsam.Pose3) -> float:
    """ADD-S [m]: mean distance of the vertices at ``T_est`` to the surface at ``T_true``.

    Exact to rounding. The first call with a mesh sorts its triangles (20 ms), later ones take one or
    two milliseconds; ``Adds`` is several times faster with many pairs of poses at once.

    Raises:
        ValueError: What is given is no mesh or no pose.
    """
    _check_pair(mesh, T_est, T_true)
    return _prepared(mesh)(T_est, T_true)


def _check_pair(mesh: object, T_est: object, T_true: object) -> None:
    if not (hasattr(mesh, "vertices") and hasattr(mesh, "faces")):
        raise ValueError(
            f"mesh must be a trimesh.Trimesh, got {type(mesh).__name__}: an ObjectModel has one as .mesh"
        )
    for name, T in (("T_est", T_est), ("T_true", T_true)):
        if not hasattr(T, "between"):
            raise ValueError(
                f"{name} must be a gtsam.Pose3, got {type(T).__name__}: gtsam.Pose3(matrix) makes one of a "
                "4x4 matrix"
            )


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
        (rows,) = relative_poses([T_est], [T_true])
        moved = self._vertices @ rows[:, :3].T + rows[:, 3]
        return float(self._surface.distances(moved, self._start).mean())

    def each(self, relative: np.ndarray) -> np.ndarray:
        """ADD-S [m] of many pairs of poses, shape (N,); NaN where a pose is not finite.

        Args:
            relative: ``relative_poses`` of the pairs, shape (N, 3, 4).
        """
        return self._surface.mean_distances(self._vertices, relative)


def add(mesh: trimesh.Trimesh, T_est: gtsam.Pose3, T_true: gtsam.Pose3) -> float:
    """ADD [m]: mean distance of each vertex at ``T_est`` to the same vertex at ``T_true``."""
    return float(add_each(mesh, relative_poses([T_est], [T_true]))[0])


def add_each(mesh: trimesh.Trimesh, relative: np.ndarray) -> np.ndarray:
    """ADD [m] of many pairs of poses, ``relative`` (N, 3, 4), shape (N,)."""
    from .surface.displacements import mean_displacements

    vertices = np.array(mesh.vertices, dtype=np.float64)
    return mean_displacements(vertices, np.ascontiguousarray(relative))


def translation_error(T_est: gtsam.Pose3, T_true: gtsam.Pose3, center_o: np.ndarray) -> float:
    """Distance [m] between the places of the object's centre ``center_o`` (3,) [m] at the two poses."""
    return float(translation_errors(relative_poses([T_est], [T_true]), center_o)[0])


def translation_errors(relative: np.ndarray, center_o: np.ndarray) -> np.ndarray:
    """Distances [m] as ``translation_error`` of many pairs of poses, ``relative`` (N, 3, 4), shape (N,)."""
    moved = relative[:, :, :3] @ center_o + relative[:, :, 3]
    return np.asarray(np.linalg.norm(moved - center_o, axis=1))


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
    return float(rotation_errors(relative_poses([T_est], [T_true]), symmetry)[0])


def rotation_errors(relative: np.ndarray, symmetry: dict[str, Any] | None = None) -> np.ndarray:
    """Angles [rad] as ``rotation_error`` of many pairs of poses, ``relative`` (N, 3, 4), shape (N,)."""
    between = relative[:, :, :3].transpose(0, 2, 1)
    axes = [np.asarray(a["axis"], float) for a in (symmetry or {}).get("symmetries_continuous", [])]
    turns = [np.eye(3)]
    turns += [
        np.reshape(s, (4, 4))[:3, :3] for s in (symmetry or {}).get("symmetries_discrete", [])
    ]
    if any(np.linalg.norm(np.cross(axes[0], axis)) > 1e-6 for axis in axes[1:]):
        return np.zeros(len(relative))
    if axes:
        axis = axes[0] / np.linalg.norm(axes[0])
        # With every turn about the axis allowed, what remains is how far the axis itself is off.
        angles = [_angles_between(between @ (turn @ axis), axis) for turn in turns]
    else:
        angles = [_angles(between @ turn) for turn in turns]
    return np.asarray(np.min(angles, axis=0))


def relative_poses(T_est: Sequence[gtsam.Pose3], T_true: Sequence[gtsam.Pose3]) -> np.ndarray:
    """T_true^-1 T_est of each pair of poses as rows (R | t), shape (N, 3, 4)."""
    pairs = zip(T_est, T_true, strict=True)
    matrices = [true.between(est).matrix()[:3] for est, true in pairs]
    return np.array(matrices).reshape(-1, 3, 4)


def _angles(R: np.ndarray) -> np.ndarray:
    """Angles of rotations (N, 3, 3) [rad]; from sine and cosine, since the cosine alone loses small ones."""
    axis = [R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]]
    trace = np.trace(R, axis1=1, axis2=2)
    return np.asarray(np.arctan2(np.linalg.norm(axis, axis=0), trace - 1))


def _angles_between(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """Angles between vectors (N, 3) and one vector (3,) [rad]."""
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(a, b), axis=1), a @ b))


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
