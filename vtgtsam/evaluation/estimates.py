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
    rows: list[dict[str, Any]] = []
    for method, of_method in estimates.items():
        for estimate, bits in zip(of_method, contacts, strict=True):
            rows.append(_row(method, estimate, of_method[0].time, bits))
    return pa.Table.from_pylist(rows, schema=SCHEMA)


def poses(rows: Sequence[Mapping[str, Any]]) -> list[gtsam.Pose3 | None]:
    """Poses T_wo of the table's rows, None where a row has none."""
    return [None if row["x"] is None else _pose(row) for row in rows]


def _row(method: str, estimate: Estimate, start: float, bits: np.ndarray) -> dict[str, Any]:
    row = {
        "method": method,
        "time": estimate.time,
        "time_rel": estimate.time - start,
        "status": estimate.status,
        "visual_weight": estimate.visual_weight,
        "contacts": [bool(bit) for bit in bits],
    }
    if estimate.T_wo is not None:
        quaternion: Any = estimate.T_wo.rotation().toQuaternion()
        numbers = [*estimate.T_wo.translation(), *quaternion.coeffs()]  # coeffs: xyzw
        row |= dict(zip(POSE, numbers, strict=True))
    upper = np.asarray(estimate.covariance)[np.triu_indices(6)]
    return row | dict(zip(COVARIANCE, upper.tolist(), strict=True))


def _pose(row: Mapping[str, Any]) -> gtsam.Pose3:
    x, y, z, qx, qy, qz, qw = (row[name] for name in POSE)
    return gtsam.Pose3(gtsam.Rot3.Quaternion(qw, qx, qy, qz), np.array([x, y, z]))
