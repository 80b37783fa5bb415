# SPDX-License-Identifier: MIT
"""What is left over in a grasp once the robot is calibrated."""

from __future__ import annotations

from typing import NamedTuple

import gtsam
import numpy as np
from gtsam.symbol_shorthand import B

from ..factors.jointed_pads import JointedPads
from ..factors.seen_by_camera import seen_residual
from ..sdf.search import ClosestPoints
from .graph import CAMERA, ZEROS, pose_key
from .keyframes import Grasp


class Residuals(NamedTuple):
    """Root mean squares over a grasp's keyframes.

    Attributes:
        contact: Of touching pads' distances to the surface, their offsets taken off [m].
        vision: Of the visual poses' positions [m].
        stand_off: Mean of the contacts' offsets [m]: how far the object is from being its mesh.
    """

    contact: float
    vision: float
    stand_off: float


def residuals(
    grasp: Grasp, number: int, values: gtsam.Values, camera_origin: np.ndarray
) -> Residuals:
    """A grasp's residuals at a solution; NaN where it has none of a kind."""
    closest = ClosestPoints(grasp.hand, grasp.obj.sdf)
    camera, zeros = values.atVector(CAMERA), values.atVector(ZEROS)
    offsets = values.atVector(B(number))
    touched = np.any([frame.touching for frame in grasp.keyframes], axis=0)
    gaps: list[np.ndarray] = []
    seen: list[float] = []
    for index, frame in enumerate(grasp.keyframes):
        T_ho = values.atPose3(pose_key(number, index))
        contacts = JointedPads(grasp.hand, closest, frame.joints, frame.touching).at(T_ho, zeros)
        gaps.append((contacts.distances - offsets)[frame.touching])
        if frame.T_wo_visual is not None:
            residual, *_ = seen_residual(T_ho, camera, frame.T_wh, frame.T_wo_visual, camera_origin)
            seen.append(float(residual[3:] @ residual[3:]))
    return Residuals(
        contact=_root_mean(np.square(np.concatenate(gaps))) if gaps else float("nan"),
        vision=_root_mean(np.array(seen)),
        stand_off=float(offsets[touched].mean()) if touched.any() else float("nan"),
    )


def _root_mean(squares: np.ndarray) -> float:
    return float(np.sqrt(squares.mean())) if len(squares) else float("nan")
