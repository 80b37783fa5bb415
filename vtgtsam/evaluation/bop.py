# SPDX-License-Identifier: MIT
"""``bop/<method>.csv``: poses in the camera frame as bop_toolkit reads them.

Columns scene_id, im_id, obj_id, score, R (9 numbers, row by row), t (3 numbers [mm]), time (-1: not measured).
BOP numbers everything: ``bop/scenes.csv`` says which sequence and object the numbers mean, im_id counts a
sequence's frames from 0. Frames without a pose, of the object or of the camera, are left out: the format
cannot say so.
"""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Mapping, Sequence
from typing import Any

import gtsam
import numpy as np
from numpy.typing import ArrayLike

from .estimates import poses

HEADER = "scene_id,im_id,obj_id,score,R,t,time\n"


def bop_lines(
    scene: int,
    obj: int,
    camera_poses: Sequence[tuple[float, ArrayLike]],
    rows: Sequence[Mapping[str, Any]],
) -> list[str]:
    """Lines of one sequence, ``rows`` of its estimates by one method.

    Args:
        scene: The sequence's number.
        obj: The object's number.
        camera_poses: Times [s] from which on the camera has a pose, increasing, and that pose T_wc,
            shape (4, 4).
        rows: Rows of the estimates' table, one a frame.
    """
    since = [time for time, _ in camera_poses]
    cameras = [gtsam.Pose3(np.asarray(T_wc, dtype=np.float64)) for _, T_wc in camera_poses]
    lines = []
    for image, (row, T_wo) in enumerate(zip(rows, poses(rows), strict=True)):
        camera = bisect_right(since, row["time"]) - 1
        if T_wo is not None and camera >= 0:
            T_co = cameras[camera].between(T_wo)
            R, t_mm = T_co.rotation().matrix(), T_co.translation() * 1e3
            lines.append(f"{scene},{image},{obj},1.0,{_numbers(R)},{_numbers(t_mm)},-1\n")
    return lines


def _numbers(values: np.ndarray) -> str:
    return " ".join(map(repr, values.ravel().tolist()))
