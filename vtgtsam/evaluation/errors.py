# SPDX-License-Identifier: MIT
"""``metrics.parquet``: how far each frame's estimate is from the truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gtsam
import numpy as np
import pyarrow as pa

from ..estimate import Estimate
from ..metrics import Adds, add_each, relative_poses, rotation_errors, translation_errors
from ..objects import ObjectModel
from ..recording import Recording
from .consistency import nees

SCHEMA = pa.schema(
    [
        ("sequence", pa.string()),
        ("object", pa.string()),
        ("dataset", pa.string()),
        ("method", pa.string()),
        ("time", pa.float64()),  # [s]
        ("time_rel", pa.float64()),  # [s], since the sequence's first frame
        ("adds_m", pa.float64()),  # null where there is no pose
        ("add_m", pa.float64()),
        ("translation_m", pa.float64()),  # at the object's centre
        ("rotation_rad", pa.float64()),  # smallest over the object's symmetries
        (
            "nees",
            pa.float64(),
        ),  # per degree of freedom, modulo symmetries; null where no direction is finite
        ("nees_dof", pa.int8()),
        ("status", pa.string()),
        ("phase", pa.string()),  # "before", "turning" or "after" the turn of the hand
    ]
)


def errors_table(
    recording: Recording,
    estimates: Mapping[str, Sequence[Estimate]],
    phases: Sequence[str],
    about: Mapping[str, Any],
) -> tuple[pa.Table, str]:
    """All methods' errors in the frames whose true pose is known, and a word on what is missing.

    Args:
        recording: Has the truth and the object's mesh.
        estimates: Each method's estimates, one a frame.
        phases: Each frame's phase.
        about: Sequence, object and dataset.
    """
    obj = recording.object
    if recording.ground_truth is None:
        return SCHEMA.empty_table(), "no ground truth: estimated, but nothing to compare with"
    if obj.mesh is None:
        return SCHEMA.empty_table(), "the object has no mesh: estimated, but no ADD-S without one"
    times = np.array([estimate.time for estimate in next(iter(estimates.values()))])
    truth = recording.truth_at(times)
    known = [(n, T_true) for n, T_true in enumerate(truth) if T_true is not None]
    rows = [
        (n, method, of_method[n], T_true)
        for method, of_method in estimates.items()
        for n, T_true in known
    ]
    of_frame = np.array([n for n, _, _, _ in rows], dtype=int)
    names = {name: [about[name]] * len(rows) for name in ("sequence", "object", "dataset")}
    columns = names | {
        "method": [method for _, method, _, _ in rows],
        "time": times[of_frame],
        "time_rel": times[of_frame] - times[0],
        **_errors(obj, [estimate.T_wo for _, _, estimate, _ in rows], [T for _, _, _, T in rows]),
        **_consistency(obj, [estimate for _, _, estimate, _ in rows], [T for _, _, _, T in rows]),
        "status": [estimate.status for _, _, estimate, _ in rows],
        "phase": [phases[n] for n in of_frame],
    }
    unknown = len(truth) - len(known)
    note = f"{unknown} of {len(truth)} frames have no ground truth" if unknown else ""
    return pa.Table.from_pydict(columns, schema=SCHEMA), note


def _errors(
    obj: ObjectModel, T_est: Sequence[gtsam.Pose3 | None], T_true: Sequence[gtsam.Pose3]
) -> dict[str, pa.Array]:
    """Columns of errors, null where there is no estimate."""
    there = np.array([T is not None for T in T_est], dtype=bool)
    relative = relative_poses(
        [T for T in T_est if T is not None],
        [true for est, true in zip(T_est, T_true, strict=True) if est is not None],
    )
    errors = {
        "adds_m": Adds(obj.mesh).each(relative),
        "add_m": add_each(obj.mesh, relative),
        "translation_m": translation_errors(relative, obj.center),
        "rotation_rad": rotation_errors(relative, obj.symmetry),
    }
    columns = {}
    for name, values in errors.items():
        column = np.full(len(there), np.nan)
        column[there] = values
        columns[name] = pa.array(column, mask=~there)
    return columns


def _consistency(
    obj: ObjectModel, estimates: Sequence[Estimate], T_true: Sequence[gtsam.Pose3]
) -> dict[str, pa.Array]:
    """Columns of errors in units of their covariances, null where there is no estimate or no covariance."""
    poses = {n: e.T_wo for n, e in enumerate(estimates) if e.T_wo is not None}
    there = list(poses)
    values, dof = nees(
        list(poses.values()),
        np.array([estimates[n].covariance for n in there]).reshape(-1, 6, 6),
        [T_true[n] for n in there],
        obj.symmetry,
    )
    column, degrees = np.full(len(estimates), np.nan), np.zeros(len(estimates), dtype=np.int8)
    column[there], degrees[there] = values, dof
    known = np.isfinite(column)
    return {"nees": pa.array(column, mask=~known), "nees_dof": pa.array(degrees)}
