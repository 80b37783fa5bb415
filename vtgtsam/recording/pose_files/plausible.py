# SPDX-License-Identifier: MIT
"""Whether poses from a file can be of the object in a recording, and if not, what is wrong with them.

People meet the same three mistakes again and again: translations in millimetres, poses in the other
frame, and a mesh whose origin lies elsewhere. The recording tells them apart, since it knows about
where the object is: from the truth, else from the visual poses it has, else from the hand.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import gtsam
import numpy as np

from ...exceptions import RecordingError, VtgtsamError
from ...measurement import Measurement
from ...objects import ObjectModel
from .. import Recording
from .files import PoseFiles
from .formats import Frame

UNITS = {1.0: "metres", 1e-1: "decimetres", 1e-2: "centimetres", 1e-3: "millimetres"}
FACTORS = (1.0, 1e-3, 1e3, 1e-2, 1e2, 1e-1, 1e1)  # between units that people use
MUCH_NEARER = (
    0.3  # of the distance as read: poses for other instants may come a little nearer by chance
)
MOVES = 0.02  # [m], an object that goes less far is at rest
LEAST_OFFSET = 0.005  # [m], a smaller one is a matter of the tracker's accuracy
STEADY = 0.2  # an offset that varies by a larger share of itself is no matter of the mesh
SAME_POINT = 0.003  # [m]


@dataclass(frozen=True, eq=False)
class Reference:
    """About where the object is.

    Attributes:
        what: Where that is known from, in words.
        centers_w: Its centre at each instant asked for [m], shape (N, 3), NaN where not known.
        tolerance: How far off a useful pose's centre may be [m].
        poses: Its pose at each of them, None where not known; empty where only the centre is.
    """

    what: str
    centers_w: np.ndarray
    tolerance: float
    poses: Sequence[gtsam.Pose3 | None]


def find_reference(recording: Recording, times: np.ndarray) -> Reference | None:
    """What a recording knows of its object's place at instants [s], or None."""
    try:
        obj = recording.object
        for what, trajectory, sizes in (
            ("the true pose", recording.ground_truth, 1.0),
            ("the recorded visual pose", recording.visual_poses, 2.0),
        ):
            if trajectory is not None:
                poses = trajectory.at(times)
                return Reference(what, _centers(poses, obj), sizes * _longest(obj), poses)
        return _near_hand(recording, obj, times)
    except VtgtsamError:  # no object, no hand: nothing to compare with
        return None


def _near_hand(recording: Recording, obj: ObjectModel, times: np.ndarray) -> Reference:
    measurements = recording.measurements(rate=10.0)
    pads = [_pads(recording, m) for m in measurements]
    middles = np.array([p.mean(axis=0) for p in pads])
    index = np.searchsorted([m.time for m in measurements], times).clip(max=len(measurements) - 1)
    reach = float(np.linalg.norm(pads[0] - middles[0], axis=1).max())
    return Reference("the hand", middles[index], 2 * reach + _longest(obj), [])


def _pads(recording: Recording, measurement: Measurement) -> np.ndarray:
    """Positions of the pads in the world [m], shape (K, 3)."""
    assert measurement.joints is not None  # a recording's measurements have them
    T_wp = recording.hand.pad_transforms(measurement.joints, measurement.T_wh)
    positions: np.ndarray = T_wp[:, :3, 3]
    return positions


def _longest(obj: ObjectModel) -> float:
    extents = obj.sdf.upper - obj.sdf.lower if obj.mesh is None else obj.mesh.extents
    return float(np.max(extents))


def _centers(poses: Sequence[gtsam.Pose3 | None], obj: ObjectModel) -> np.ndarray:
    nothing = np.full(3, np.nan)
    return np.array([nothing if T is None else T.transformFrom(obj.center) for T in poses])


def in_world(files: PoseFiles, recording: Recording, times: np.ndarray) -> list[gtsam.Pose3 | None]:
    """The files' poses at their instants [s] as T_wo.

    Raises:
        RecordingError: They are in the camera frame and the recording does not say where that is.
    """
    if files.frame == "world":
        return files.poses
    cameras = [recording.camera_pose_at(time) for time in times.tolist()]
    if not any(cameras):
        raise RecordingError(
            f"the poses in {files.path} are in the camera frame, but {recording.path} does not say "
            "where the camera is (/camera/pose); give poses in the world and --frame world"
        )
    pairs = zip(cameras, files.poses, strict=True)
    return [None if T_wc is None or T_co is None else T_wc * T_co for T_wc, T_co in pairs]


def check_unit_and_frame(
    files: PoseFiles, recording: Recording, times: np.ndarray, reference: Reference
) -> None:
    """Refuse poses that are far from the object and would be near it in another unit or frame.

    Raises:
        RecordingError: It says which.
    """
    off = _distance(files, recording, times, reference)
    if not off > reference.tolerance:  # a NaN says nothing
        return
    best, nearest = files, min(reference.tolerance, MUCH_NEARER * off)
    frames: tuple[Frame, Frame] = ("camera", "world")
    for frame, factor in itertools.product(frames, FACTORS):
        other = files.replaced(files.scale * factor, frame)
        if frame == "camera" and recording.camera_pose is None:
            continue
        distance = _distance(other, recording, times, reference)
        if distance < nearest and _moves_alike(other, recording, times, reference):
            best, nearest = other, distance
    if best is not files:
        raise RecordingError(
            f"{files.path} puts the object {length(off)} from {reference.what}: its poses look "
            f"like {_difference(files, best)}"
        )


def _difference(files: PoseFiles, other: PoseFiles) -> str:
    """What the poses are and what to type, in words."""
    words, options = [], []
    if not np.isclose(other.scale, files.scale):
        unit = next((name for value, name in UNITS.items() if np.isclose(value, other.scale)), None)
        words.append(unit or f"a unit of {other.scale:g} m")
        options.append(f"--scale {other.scale:g}")
    if other.frame != files.frame:
        words.append(f"poses in the {other.frame} frame")
        options.append(f"--frame {other.frame}")
    return f"{' and '.join(words)}; give {' '.join(options)}"


def _distance(
    files: PoseFiles, recording: Recording, times: np.ndarray, reference: Reference
) -> float:
    """Median distance of the object's centre to where it should be [m]; NaN where never known."""
    centers = _centers(in_world(files, recording, times), recording.object)
    distances = np.linalg.norm(centers - reference.centers_w, axis=1)
    known = distances[np.isfinite(distances)]
    return float(np.median(known)) if len(known) else float("nan")


def _moves_alike(
    files: PoseFiles, recording: Recording, times: np.ndarray, reference: Reference
) -> bool:
    """Whether the object goes about as far as it should, where it is known to go anywhere.

    A wrong unit may bring it near by bringing everything near the origin.
    """
    centers = _centers(in_world(files, recording, times), recording.object)
    known = np.isfinite(centers).all(axis=1) & np.isfinite(reference.centers_w).all(axis=1)
    if not reference.poses or not known.any():
        return True
    goes, should = (
        np.linalg.norm(np.ptp(np.quantile(c[known], (0.05, 0.95), axis=0), axis=0))
        for c in (centers, reference.centers_w)
    )
    return bool(should < MOVES or goes > 0.3 * should)


def explain_offset(
    poses: Sequence[gtsam.Pose3 | None], recording: Recording, reference: Reference
) -> str | None:
    """A sentence on a mesh with another origin, where the poses look like that; else None.

    Such poses have the object's true centre at one wrong place in their own frame, in every image,
    however the object moves.
    """
    obj = recording.object
    places = [
        T.transformTo(true.transformFrom(obj.center)) - obj.center
        for T, true in zip(poses, reference.poses, strict=False)
        if T is not None and true is not None
    ]
    if not places:
        return None
    offset = -np.median(places, axis=0)
    spread = float(np.median(np.linalg.norm(places + offset, axis=1)))
    size = float(np.linalg.norm(offset))
    if size < LEAST_OFFSET or spread > STEADY * size:
        return None
    option, whose = ",".join(f"{x:.4f}" for x in offset), "a mesh with another origin"
    for name, (point, owner) in origins(obj).items():
        if np.linalg.norm(offset - point) < SAME_POINT:
            option, whose = name, owner
    if option not in origins(obj) and size > _longest(
        obj
    ):  # nobody models a mug so far beside its origin
        return None
    return (
        f"in the object's own frame the poses lie {length(size)} from {reference.what}, the same "
        f"way in every image to within {length(spread)}, as with {whose}; if so, "
        f"give --offset={option}; otherwise this is the tracker's own error: do not remove it with "
        "the truth"
    )


def origins(obj: ObjectModel) -> dict[str, tuple[np.ndarray, str]]:
    """Points that a tracker's mesh may have as its origin, by name: where they are [m], and what."""
    return {
        "file": (-np.array(obj.origin), "the mesh file's own origin"),
        "center": (obj.center, "the middle of the bounding box as origin"),
    }


def length(metres: float) -> str:
    """A length in words, in metres or millimetres."""
    return f"{metres:.2f} m" if metres >= 1 else f"{metres * 1e3:.1f} mm"
