# SPDX-License-Identifier: MIT
"""``estimates/<sequence>.parquet``: one row a frame and method."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations_with_replacement
from typing import Any

import gtsam
import numpy as np
import pyarrow as pa

from ..estimate import Estimate

TANGENT = (
    "rx",
    "ry",
    "rz",
    "tx",
    "ty",
    "tz",
)  # rotation [rad] first, right perturbation, as in GTSAM
POSE = ("x", "y", "z", "qx", "qy", "qz", "qw")  # T_world_object, [m] and unit quaternion
COVARIANCE = tuple(f"cov_{a}_{b}" for a, b in combinations_with_replacement(TANGENT, 2))

SCHEMA = pa.schema(
    [
        ("method", pa.string()),
        ("time", pa.float64()),  # [s], the recording's own clock
        ("time_rel", pa.float64()),  # [s], since the sequence's first frame
        *((name, pa.float64()) for name in POSE),  # null where there is no pose
        *((name, pa.float64()) for name in COVARIANCE),  # upper triangle, row by row
        ("status", pa.string()),
        ("mode", pa.string()),  # null without memory
        ("faults", pa.list_(pa.string())),
        ("events", pa.list_(pa.string())),
        ("visual_weight", pa.float64()),
        ("contacts", pa.list_(pa.bool_())),  # in the order of the hand's pad names
    ]
)


def estimates_table(
    estimates: Mapping[str, Sequence[Estimate]], contacts: Sequence[np.ndarray]
) -> pa.Table:
    """All methods' estimates of one sequence.

    Args:
        estimates: Each method's estimates, one a frame.
        contacts: Contact bits of each frame in the hand's pad order, shape (N, K).
    """
    every = [estimate for of_method in estimates.values() for estimate in of_method]
    covariances = np.array([estimate.covariance for estimate in every]).reshape(-1, 6, 6)
    bits = np.tile(np.asarray(contacts, dtype=bool).reshape(len(contacts), -1), (len(estimates), 1))
    columns = {
        "method": [method for method, of_method in estimates.items() for _ in of_method],
        "time": [estimate.time for estimate in every],
        "time_rel": [
            e.time - of_method[0].time for of_method in estimates.values() for e in of_method
        ],
        **_poses([estimate.T_wo for estimate in every]),
        **dict(zip(COVARIANCE, covariances[:, *np.triu_indices(6)].T, strict=True)),
        "status": [estimate.status for estimate in every],
        "mode": [estimate.mode for estimate in every],
        "faults": [list(estimate.faults) for estimate in every],
        "events": [list(estimate.events) for estimate in every],
        "visual_weight": [estimate.visual_weight for estimate in every],
        "contacts": bits.tolist(),
    }
    return pa.Table.from_pydict(columns, schema=SCHEMA)


def poses(rows: Sequence[Mapping[str, Any]]) -> list[gtsam.Pose3 | None]:
    """Poses T_wo of the table's rows, None where a row has none."""
    return [None if row["x"] is None else _pose(row) for row in rows]


def covariances(rows: Sequence[Mapping[str, Any]]) -> list[np.ndarray]:
    """Covariances of the table's rows, (6, 6), rotation first."""
    upper = np.triu_indices(6)
    found = np.empty((len(rows), 6, 6))
    for covariance, row in zip(found, rows, strict=True):
        covariance[upper] = [row[name] for name in COVARIANCE]
        covariance.T[upper] = covariance[upper]
    return list(found)


def _poses(T_wo: Sequence[gtsam.Pose3 | None]) -> dict[str, pa.Array]:
    """Columns of translations [m] and quaternions, null where there is no pose."""
    there = np.array([T is not None for T in T_wo], dtype=bool)
    numbers = np.full((len(there), len(POSE)), np.nan)
    for n, T in enumerate(T_wo):
        if T is not None:
            quaternion: Any = T.rotation().toQuaternion()
            numbers[n] = [*T.translation(), *quaternion.coeffs()]  # coeffs: xyzw
    return {
        name: pa.array(column, mask=~there) for name, column in zip(POSE, numbers.T, strict=True)
    }


def _pose(row: Mapping[str, Any]) -> gtsam.Pose3:
    x, y, z, qx, qy, qz, qw = (row[name] for name in POSE)
    return gtsam.Pose3(gtsam.Rot3.Quaternion(qw, qx, qy, qz), np.array([x, y, z]))
