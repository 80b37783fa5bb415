# SPDX-License-Identifier: MIT
"""``metrics.parquet``: how far each frame's estimate is from the truth."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gtsam
import pyarrow as pa

from ..estimate import Estimate
from ..metrics import Adds, add, rotation_error, translation_error
from ..objects import ObjectModel
from ..recording import Recording

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
    times = [estimate.time for estimate in next(iter(estimates.values()))]
    truth = recording.truth_at(times)
    errors = _Errors(obj)
    names = {name: about[name] for name in ("sequence", "object", "dataset")}
    rows = [
        names
        | {"method": method, "time": estimate.time, "time_rel": estimate.time - times[0]}
        | {"status": estimate.status, "phase": phase}
        | ({} if estimate.T_wo is None else errors(estimate.T_wo, T_true))
        for method, of_method in estimates.items()
        for estimate, phase, T_true in zip(of_method, phases, truth, strict=True)
        if T_true is not None
    ]
    unknown = sum(T_true is None for T_true in truth)
    note = f"{unknown} of {len(truth)} frames have no ground truth" if unknown else ""
    return pa.Table.from_pylist(rows, schema=SCHEMA), note


class _Errors:
    """An estimate's errors. Made anew for each sequence, so that none depends on the one before."""

    def __init__(self, obj: ObjectModel) -> None:
        self._obj = obj
        self._adds = Adds(obj.mesh)

    def __call__(self, T_est: gtsam.Pose3, T_true: gtsam.Pose3) -> dict[str, float]:
        return {
            "adds_m": self._adds(T_est, T_true),
            "add_m": add(self._obj.mesh, T_est, T_true),
            "translation_m": translation_error(T_est, T_true, self._obj.center),
            "rotation_rad": rotation_error(T_est, T_true, self._obj.symmetry),
        }
