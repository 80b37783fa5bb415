# SPDX-License-Identifier: MIT
"""Poses written by another convention: inverse, transposed, w first, or for a camera that looks along -z."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence

import gtsam
import numpy as np

from ...exceptions import RecordingError
from ...metrics import rotation_error
from ...objects import ObjectModel
from ..consistency.rotation import AGREE, MOST_POSES, explain_turn, turned_by, w_first
from ..recording import Recording
from .files import PoseFiles
from .plausible import Reference, in_world, length

OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
NEAR = 0.3  # of the object's longest extent, to where its centre must come
MOST_SCALE = 0.02  # by which a rotation's determinant may be another than 1

Matrix = Callable[[np.ndarray], np.ndarray]


def _inverse(T: np.ndarray) -> np.ndarray:
    try:
        return np.asarray(np.linalg.inv(T))
    except np.linalg.LinAlgError:
        return np.full((4, 4), np.nan)


def _rotation(T: np.ndarray, change: Matrix) -> np.ndarray:
    other = T.copy()
    other[:3, :3] = change(T[:3, :3])
    return other


# What it is, how to mend it, and what the poses would then be.
CONVENTIONS: tuple[tuple[str, str, Matrix], ...] = (
    (
        "with its quaternions read as qw qx qy qz",
        "write them as qx qy qz qw, with w last, as TUM files have them",
        lambda T: _rotation(T, w_first),
    ),
    (
        "as inverse poses, of the camera or the world in the object's frame",
        "write their inverses",
        _inverse,
    ),
    (
        "with their rotations transposed",
        "transpose the rotations",
        lambda T: _rotation(T, np.transpose),
    ),
    (
        "for a camera that looks along -z (OpenGL's, Blender's)",
        "write diag(1, -1, -1, 1) T, for a camera that looks along z with y down",
        lambda T: OPENGL @ T,
    ),
    (
        "as inverse poses for a camera that looks along -z (OpenGL's, Blender's)",
        "write diag(1, -1, -1, 1) T^-1",
        lambda T: OPENGL @ _inverse(T),
    ),
)


def check_matrices(files: PoseFiles) -> None:
    """Refuse files most of whose matrices are no poses for one reason.

    Raises:
        RecordingError: It says which.
    """
    matrices = files.table.matrices
    if 2 * sum(pose is None for pose in files.poses) <= len(matrices):
        return
    finite = matrices[np.isfinite(matrices).all(axis=(1, 2))]
    transposed = dataclasses.replace(
        files.table, matrices=np.array([T.T for T in matrices], dtype=np.float64)
    )
    if 2 * sum(pose is not None for pose in _with(files, transposed.matrices).poses) > len(
        matrices
    ):
        raise RecordingError(
            f"the matrices in {files.path} are transposed, with the translation in the last row; write "
            "their transposes"
        )
    if len(finite) == 0:
        return
    determinant = float(np.median(np.linalg.det(finite[:, :3, :3])))
    if determinant < 0:
        raise RecordingError(
            f"the rotations in {files.path} are mirrored (their determinant is {determinant:.2f}); an axis is "
            "flipped or two are exchanged"
        )
    if abs(determinant - 1) > MOST_SCALE:
        scale = determinant ** (1 / 3)
        raise RecordingError(
            f"the rotations in {files.path} are scaled by {scale:.3g} (their determinant is {determinant:.3g}); "
            "divide them by it: a mesh's scale belongs to --scale or the topic map"
        )


def check_conventions(
    files: PoseFiles, recording: Recording, times: np.ndarray, reference: Reference
) -> None:
    """Refuse poses that are far from the reference as read, and agree with it by another convention.

    Raises:
        RecordingError: It says by which, and what to write.
    """
    if not reference.poses:
        return
    chosen = np.unique(np.linspace(0, len(times) - 1, MOST_POSES).astype(np.int64))
    judge = _Judge(recording.object, reference, chosen)
    as_read = judge.of(_world(files, recording, times, chosen))
    if as_read is None or judge.agrees(as_read):
        return
    for how, advice, change in CONVENTIONS:
        if files.frame == "world" and "-z" in how:
            continue
        other = _with(files, np.array([change(T) for T in files.table.matrices]))
        found = judge.of(_world(other, recording, times, chosen))
        if found is not None and found[0] < judge.near and found[1] < AGREE:
            raise RecordingError(
                f"{files.path} puts the object {length(as_read[0])} and {np.rad2deg(as_read[1]):.0f} degrees "
                f"away from {reference.what}, and {length(found[0])} and {np.rad2deg(found[1]):.0f} degrees "
                f"{how}; {advice}"
            )


def explain_rotation(
    poses: Sequence[gtsam.Pose3 | None], obj: ObjectModel, reference: Reference
) -> list[str]:
    """A sentence where poses in the world turn the object so that it looks different, as from another mesh."""
    step = -(-len(poses) // MOST_POSES)
    pairs = [
        (T, T_ref)
        for T, T_ref in zip(poses[::step], list(reference.poses)[::step], strict=False)
        if T is not None and T_ref is not None
    ]
    seen, true = [T for T, _ in pairs], [T for _, T in pairs]
    angle = turned_by(seen, true, obj)
    if angle is None:
        return []
    R = np.array([T.rotation().matrix() for T in seen])
    explained = explain_turn(R, np.array([T.rotation().matrix() for T in true]), obj)
    return [
        f"the poses turn the object by {np.rad2deg(angle):.0f} degrees from {reference.what} (median)"
        + (f"; they agree with {explained}" if explained else "; check the mesh that was tracked")
    ]


def _with(files: PoseFiles, matrices: np.ndarray) -> PoseFiles:
    return dataclasses.replace(files, table=dataclasses.replace(files.table, matrices=matrices))


def _world(
    files: PoseFiles, recording: Recording, times: np.ndarray, chosen: np.ndarray
) -> list[gtsam.Pose3 | None]:
    few = _with(files, files.table.matrices[chosen])
    return in_world(few, recording, times[chosen])


class _Judge:
    """How far poses are from the reference."""

    def __init__(self, obj: ObjectModel, reference: Reference, chosen: np.ndarray) -> None:
        self._obj, self._tolerance = obj, reference.tolerance
        self._true = [reference.poses[i] for i in chosen.tolist()]
        extents = obj.sdf.upper - obj.sdf.lower if obj.mesh is None else obj.mesh.extents
        self.near = NEAR * float(np.max(extents))
        self._pairs: list[tuple[gtsam.Pose3, gtsam.Pose3]] = []

    def of(self, poses: list[gtsam.Pose3 | None]) -> tuple[float, float] | None:
        """Median distance of the object's centre [m] and median angle [rad]; None where nothing is known."""
        pairs = [
            (T, true)
            for T, true in zip(poses, self._true, strict=True)
            if T is not None and true is not None
        ]
        self._pairs = pairs
        if not pairs:
            return None
        center = self._obj.center
        off = [
            np.linalg.norm(T.transformFrom(center) - true.transformFrom(center))
            for T, true in pairs
        ]
        angles = [rotation_error(T, true, self._obj.symmetry) for T, true in pairs]
        return float(np.median(off)), float(np.median(angles))

    def agrees(self, as_read: tuple[float, float]) -> bool:
        """Whether the poses judged last are near enough, and do not look turned."""
        if as_read[0] > self._tolerance:
            return False
        seen, true = [T for T, _ in self._pairs], [T for _, T in self._pairs]
        if self._obj.mesh is None:
            return bool(as_read[1] < np.deg2rad(60))
        return turned_by(seen, true, self._obj) is None
