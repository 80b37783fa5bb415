# SPDX-License-Identifier: MIT
"""One sequence's estimates as an episode: at a fixed rate, with the columns of a LeRobot dataset.

LeRobot wants frame k at k / fps. The estimates are where the images were, so each frame has the last estimate
before it, held as recordings' streams are, and says how old that is. An episode begins with the first pose.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ..estimates import POSE, TANGENT

OBJECT = "observation.environment_state"  # LeRobot's own name for what is not the robot's
CONTACTS = "observation.contacts"
SIGMA = "estimate.sigma"
STATUS = "estimate.status"
AGE = "estimate.age"

_SAME_INSTANT = 1e-6  # [s]


def features(pads: Sequence[str]) -> dict[str, dict[str, Any]]:
    """What ``info.json`` says of the columns, for a hand with these pads."""
    return {
        OBJECT: _numbers(POSE),  # T_world_object, [m] and unit quaternion
        CONTACTS: _numbers(pads),  # 1 where a pad touches, else 0
        SIGMA: _numbers(TANGENT),  # standard deviations [rad] and [m], inf where nothing measures
        STATUS: {"dtype": "string", "shape": [1], "names": None},
        AGE: {"dtype": "float32", "shape": [1], "names": None},  # [s]
    }


def episode(rows: Sequence[Mapping[str, Any]], fps: int) -> dict[str, Any]:
    """The columns of one episode by name, arrays of N frames; empty where no row has a pose.

    Args:
        rows: Rows of the estimates' table of one method, in the order of their time.
        fps: Frames a second.
    """
    first = next((n for n, row in enumerate(rows) if row["x"] is not None), None)
    if first is None:
        return {}
    rows = rows[first:]
    times = np.array([row["time"] for row in rows])
    count = int((times[-1] - times[0] + _SAME_INSTANT) * fps) + 1
    instants = times[0] + np.arange(count) / fps
    held = np.searchsorted(times, instants + _SAME_INSTANT, side="right") - 1
    return {
        OBJECT: _poses(rows)[held],
        CONTACTS: np.array([row["contacts"] for row in rows], dtype=np.float32)[held],
        SIGMA: _sigmas(rows)[held],
        STATUS: [rows[n]["status"] for n in held],
        AGE: np.maximum(instants - times[held], 0.0).astype(np.float32),
    }


def rate(times: Sequence[float]) -> int:
    """The whole number of frames a second that comes closest to the estimates', at least 1."""
    steps = np.diff(np.asarray(times, dtype=float))
    steps = steps[steps > 0]
    return max(1, round(1 / float(np.median(steps)))) if len(steps) else 1


def _numbers(names: Sequence[str]) -> dict[str, Any]:
    return {"dtype": "float32", "shape": [len(names)], "names": list(names)}


def _poses(rows: Sequence[Mapping[str, Any]]) -> np.ndarray:
    """Poses, shape (N, 7), the last one where a row has none; quaternions of one sign throughout."""
    poses = np.empty((len(rows), len(POSE)))
    for n, row in enumerate(rows):
        poses[n] = poses[n - 1] if row["x"] is None else [row[name] for name in POSE]
    turned = np.sum(poses[1:, 3:] * poses[:-1, 3:], axis=1) < 0
    poses[1:, 3:] *= np.where(np.cumsum(turned) % 2, -1.0, 1.0)[:, None]
    return poses.astype(np.float32)


def _sigmas(rows: Sequence[Mapping[str, Any]]) -> np.ndarray:
    variances = np.array([[row[f"cov_{name}_{name}"] for name in TANGENT] for row in rows])
    sigmas: np.ndarray = np.sqrt(variances).astype(np.float32)
    return sigmas
