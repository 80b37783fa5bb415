# SPDX-License-Identifier: MIT
"""Quaternions written with w first, where a TUM file has it last."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import gtsam
import numpy as np

from ...exceptions import RecordingError
from ...metrics import Adds, rotation_error
from ...objects import ObjectModel
from .. import Recording
from .files import PoseFiles
from .plausible import Reference, in_world

if TYPE_CHECKING:
    import trimesh

DISAGREE = np.deg2rad(60)  # a tracker that follows the object is better than this
AGREE = np.deg2rad(20)
MUCH_WORSE = 2.0  # as read, ADD-S is more than that times what it is with w first,
SHARE = 0.01  # and by more than that share of the object's longest extent
MOST_POSES = 50  # whose ADD-S is computed, a millisecond or two each

Pair = tuple[gtsam.Pose3, gtsam.Pose3]


def check_quaternion_order(
    files: PoseFiles, recording: Recording, times: np.ndarray, reference: Reference
) -> None:
    """Refuse a TUM file whose rotations are wrong as read and right with w first.

    Rotations alone tell too little, for an object may look the same turned: as read, it must also look
    much less like it does at the reference, by ADD-S.

    Raises:
        RecordingError: The file has w first.
    """
    if files.table.kind != "TUM file":
        return
    obj = recording.object
    as_read = _pairs(in_world(files, recording, times), reference)
    w_first = _pairs(in_world(files.with_w_first(), recording, times), reference)
    read, other = _median_angle(as_read, obj), _median_angle(w_first, obj)
    if not (read > DISAGREE and other < AGREE):  # a NaN says nothing
        return
    if obj.mesh is not None and not _looks_much_worse(as_read, w_first, obj.mesh, obj.center):
        return
    raise RecordingError(
        f"{files.path} turns the object {np.rad2deg(read):.0f} degrees away from {reference.what}, "
        f"and {np.rad2deg(other):.0f} degrees with its quaternions read as qw qx qy qz; write them "
        "as qx qy qz qw, with w last, as TUM files have them"
    )


def _pairs(poses: Sequence[gtsam.Pose3 | None], reference: Reference) -> list[Pair]:
    return [
        (T, T_ref)
        for T, T_ref in zip(poses, reference.poses, strict=False)
        if T is not None and T_ref is not None
    ]


def _median_angle(pairs: list[Pair], obj: ObjectModel) -> float:
    """Median angle [rad] to the reference, up to the object's known symmetry; NaN for no pairs."""
    if not pairs:
        return float("nan")
    return float(np.median([rotation_error(T, T_ref, obj.symmetry) for T, T_ref in pairs]))


def _looks_much_worse(
    as_read: list[Pair], w_first: list[Pair], mesh: trimesh.Trimesh, center: np.ndarray
) -> bool:
    """Whether the object, turned about its centre as read, is far from where w first has it."""
    adds = Adds(mesh)
    step = -(-len(as_read) // MOST_POSES)
    read, other = (
        np.mean([adds(_about_center(T, T_ref, center), T_ref) for T, T_ref in pairs[::step]])
        for pairs in (as_read, w_first)
    )
    return bool(read > MUCH_WORSE * other + SHARE * mesh.extents.max())


def _about_center(T: gtsam.Pose3, T_ref: gtsam.Pose3, center: np.ndarray) -> gtsam.Pose3:
    """The rotation of T with the object's centre where T_ref has it."""
    return gtsam.Pose3(T.rotation(), T_ref.transformFrom(center) - T.rotation().rotate(center))
