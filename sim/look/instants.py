# SPDX-License-Identifier: MIT
"""What pictures of a recording show at given instants."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import gtsam
import numpy as np

from vtgtsam import Recording
from vtgtsam.evaluation.phases import AFTER, BEFORE, TURNING, phases_of
from vtgtsam.exceptions import RecordingError
from vtgtsam.frame import contact_bits, joints_of
from vtgtsam.recording.trajectory import PoseTrajectory

WORDS = {BEFORE: "before the turn", TURNING: "the hand turns", AFTER: "after the turn"}

ENDS = 0.1  # [s]


@dataclass(frozen=True, eq=False)
class Instant:
    """What one picture shows.

    Attributes:
        time: Instant since the first [s].
        phase: Where in the sequence that is, in words.
        joints: Joint angles in the hand's order [rad].
        T_wh: Pose of the hand, (4, 4).
        T_wo: Pose of the object, (4, 4); None where it is not known.
        contacts: Which pads touch, (K,).
        estimates: Pose of the object (4, 4) by each method that is shown, None where it has none.
        covariances: Covariances of these poses' right perturbations, rotation first, (6, 6).
    """

    time: float
    phase: str
    joints: np.ndarray
    T_wh: np.ndarray
    T_wo: np.ndarray | None
    contacts: np.ndarray
    estimates: tuple[np.ndarray | None, ...] = ()
    covariances: tuple[np.ndarray, ...] = ()


@dataclass(frozen=True, eq=False)
class Estimated:
    """What a method made of a recording.

    Attributes:
        method: Its name.
        poses: The object's poses.
        covariances: Their covariances, rotation first, (N, 6, 6).
    """

    method: str
    poses: PoseTrajectory
    covariances: np.ndarray

    def covariance_at(self, time: float) -> np.ndarray:
        """The last pose's before an instant [s], (6, 6); before all of them the first one's."""
        k = int(np.searchsorted(self.poses.times, time, side="right")) - 1
        covariance: np.ndarray = self.covariances[max(k, 0)]
        return covariance


def instants(
    recording: Recording, rate: float, estimates: Sequence[Estimated] = ()
) -> list[Instant]:
    """Evenly spaced instants of a recording.

    Args:
        recording: With joints and contacts.
        rate: Instants in a second [Hz].
        estimates: What methods made of it, to be shown beside the object.

    Raises:
        RecordingError: It has neither true nor visual poses of the object.
    """
    measurements = recording.measurements(rate)
    shown = recording.ground_truth or recording.visual_poses
    if shown is None:
        raise RecordingError(
            f"{recording.path} has no poses of the object, true or visual, to draw"
        )
    times = [m.time for m in measurements]
    phases = phases_of(measurements)
    objects = _matrices(shown, times)
    others = [_matrices(estimated.poses, times) for estimated in estimates]
    return [
        Instant(
            m.time - times[0],
            WORDS[phase],
            joints_of(m, recording.hand),
            (m.T_wh or gtsam.Pose3()).matrix(),
            T_wo,
            contact_bits(m.contacts, recording.hand.pad_names),
            tuple(poses[k] for poses in others),
            tuple(estimated.covariance_at(m.time) for estimated in estimates),
        )
        for k, (m, phase, T_wo) in enumerate(zip(measurements, phases, objects, strict=True))
    ]


def _matrices(poses: PoseTrajectory, times: Sequence[float]) -> list[np.ndarray | None]:
    """Poses (4, 4) at instants [s]; the first and the last count a little longer, for streams end apart."""
    inside = np.clip(times, poses.times[0], poses.times[-1])
    near = np.where(np.abs(inside - times) < ENDS, inside, times)
    return [None if T is None else T.matrix() for T in poses.at(near)]


def read_estimates(folder: Path, recording: Path, method: str) -> Estimated:
    """What ``vtgtsam evaluate`` stored for a recording.

    A sequence's name is its path below the folder that was evaluated, so the file is the one whose name
    agrees with the end of the recording's path.

    Raises:
        RecordingError: There are no estimates of it, or none by that method.
    """
    from vtgtsam.evaluation.estimates import covariances, poses
    from vtgtsam.evaluation.store import read_part

    parts = recording.resolve().with_suffix("").parts
    names = ["__".join(parts[k:]) for k in range(1, len(parts))]
    files = [folder / "estimates" / f"{name}.parquet" for name in names]
    file = next((file for file in files if file.is_file()), None)
    if file is None:
        raise RecordingError(
            f"{folder} holds no estimates of {recording}; give a folder that `vtgtsam evaluate` wrote"
        )
    table = read_part(file)[0].to_pylist()
    rows = [row for row in table if row["method"] == method]
    if not rows:
        methods = ", ".join(sorted({row["method"] for row in table}))
        raise RecordingError(f"{file} has no method {method!r}; it has {methods}")
    found = zip(rows, poses(rows), covariances(rows), strict=True)
    times, known, spread = zip(
        *((row["time"], T, cov) for row, T, cov in found if T is not None), strict=True
    )
    return Estimated(method, PoseTrajectory(np.array(times), list(known)), np.array(spread))
