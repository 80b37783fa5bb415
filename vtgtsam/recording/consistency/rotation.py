# SPDX-License-Identifier: MIT
"""Visual poses that turn the object away from the truth: another convention of rotations, or of the mesh.

Angles alone tell too little, for an object may look the same turned: it must also look much less like it
does at the truth, by ADD-S about its centre.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import gtsam
import numpy as np

from ..trajectory import PoseTrajectory
from .evidence import Evidence
from .finding import Finding
from .vision import visual_off_truth

if TYPE_CHECKING:
    from ...objects import ObjectModel

TURNED = np.deg2rad(45)  # a tracker that follows the object is better than this
AGREE = np.deg2rad(20)
SHARE = 0.03  # of the object's longest extent, that ADD-S must come to
MOST_POSES = 50  # whose ADD-S is computed, a millisecond or two each
OPENGL = np.diag([1.0, -1.0, -1.0])  # from a camera that looks along -z to one that looks along z


def check_rotation(evidence: Evidence) -> Iterator[Finding]:
    """Visual rotations that are usually far from the true ones, and what would make them agree."""
    obj, vision, truth = evidence.object, evidence.vision, evidence.truth
    if obj is None or vision is None or truth is None or visual_off_truth(vision, truth, obj):
        return
    seen, true = paired(vision, truth)
    angle = turned_by(seen, true, obj)
    if angle is None:
        return
    topic = evidence.topics.vision.topic
    sentence = f"visual poses turn the object by {np.rad2deg(angle):.0f} degrees from the true ones (median)"
    explained = explain_turn(*_as_written(seen, true, vision, evidence), obj)
    sentence += (
        f"; they agree with {explained}"
        if explained
        else "; unless the tracker is that bad, check the convention of its rotations and the mesh it used"
    )
    yield Finding("vision turned from the truth", sentence, "warning", topic)


def paired(
    vision: PoseTrajectory, truth: PoseTrajectory
) -> tuple[list[gtsam.Pose3], list[gtsam.Pose3]]:
    """Some visual poses, evenly, and the true ones at their instants."""
    step = -(-len(vision) // MOST_POSES)
    true = truth.at(vision.times[::step])
    pairs = [
        (T, T_true)
        for T, T_true in zip(vision.poses[::step], true, strict=True)
        if T_true is not None
    ]
    return [T for T, _ in pairs], [T for _, T in pairs]


def turned_by(seen: list[gtsam.Pose3], true: list[gtsam.Pose3], obj: ObjectModel) -> float | None:
    """Median angle [rad] by which the object is turned so that it looks different, or None."""
    from ...metrics import Adds, rotation_error

    if not seen or obj.mesh is None:
        return None
    pairs = list(zip(seen, true, strict=True))
    angle = float(np.median([rotation_error(T, T_true, obj.symmetry) for T, T_true in pairs]))
    if not angle > TURNED:
        return None
    adds = Adds(obj.mesh)
    apart = np.median([adds(_about_center(T, T_true, obj.center), T_true) for T, T_true in pairs])
    return angle if apart > SHARE * obj.mesh.extents.max() else None


def _about_center(T: gtsam.Pose3, T_true: gtsam.Pose3, center: np.ndarray) -> gtsam.Pose3:
    """The rotation of T with the object's centre where T_true has it."""
    return gtsam.Pose3(T.rotation(), T_true.transformFrom(center) - T.rotation().rotate(center))


def _as_written(
    seen: list[gtsam.Pose3], true: list[gtsam.Pose3], vision: PoseTrajectory, evidence: Evidence
) -> tuple[np.ndarray, np.ndarray]:
    """Rotations (N, 3, 3) seen and true, in the frame in which the tracker gives them."""
    R = np.array([T.rotation().matrix() for T in seen])
    R_true = np.array([T.rotation().matrix() for T in true])
    camera = evidence.streams.camera_pose
    if evidence.topics.vision.frame == "world" or camera is None:
        return R, R_true
    R_cw = camera.poses[0].rotation().matrix().T  # of a camera that hardly turns
    return R_cw @ R, R_cw @ R_true


def explain_turn(R: np.ndarray, R_true: np.ndarray, obj: ObjectModel) -> str | None:
    """The convention with which rotations (N, 3, 3) agree with the true ones, in words, or None."""
    ways = {
        "their rotations transposed": R.transpose(0, 2, 1),
        "their quaternions read as qw qx qy qz (w first)": np.array([w_first(r) for r in R]),
        "a camera whose y and z axes point the other way (OpenGL's)": OPENGL @ R,
    }
    for words, other in ways.items():
        if _median_angle(other, R_true, obj) < AGREE:
            return words
    between = R_true.transpose(0, 2, 1) @ R
    constant = gtsam.Rot3.ClosestTo(np.mean(between, axis=0)).matrix()
    if _median_angle(R @ constant.T, R_true, obj) < AGREE:
        return f"a mesh whose axes are turned by {_turn(constant)}"
    return None


def w_first(rotation: np.ndarray) -> np.ndarray:
    """The rotation (3, 3) that x y z w would be, read as w x y z."""
    q = gtsam.Rot3(rotation).toQuaternion().coeffs()  # type: ignore[attr-defined]
    # Its sign may be another than in the message, which does not change what it means in either order.
    return np.asarray(gtsam.Rot3.Quaternion(q[0], q[1], q[2], q[3]).matrix())


def _median_angle(R: np.ndarray, R_true: np.ndarray, obj: ObjectModel) -> float:
    from ...metrics import rotation_errors

    relative = np.zeros((len(R), 3, 4))
    relative[:, :, :3] = R_true.transpose(0, 2, 1) @ R
    return float(np.median(rotation_errors(relative, obj.symmetry)))


def _turn(rotation: np.ndarray) -> str:
    vector = np.asarray(gtsam.Rot3.Logmap(gtsam.Rot3(rotation)))
    angle = float(np.linalg.norm(vector))
    axis = ", ".join(f"{x:.2f}" for x in vector / angle)
    return f"{np.rad2deg(angle):.0f} degrees about ({axis})"
