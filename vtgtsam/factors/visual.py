# SPDX-License-Identifier: MIT
r"""Visual factor: the pose a visual tracker reports (paper, section III-B).

The residual is the twist from the estimate to the reported pose,

    r(T_wo) = Log(T_wo^-1 T_wo_visual),    rotation [rad] first, then translation [m],

and dr/dxi = -Jl(r)^-1 for a right perturbation of T_wo. GTSAM's own ``PriorFactorPose3`` has minus that residual: the
same objective. One Welsch loss on the weighted norm of all six lets go of a visual pose that the hand contradicts.
"""

from __future__ import annotations

from typing import Any

import gtsam
import numpy as np

from ..compiled import compiled, copy_matrix
from ..handles import Handles, array1, array2
from ..se3 import inverse_left_jacobian, log_between

# The arrays of ``VisualTerm.handles``, in order.
POSE, WHITENING, SETTINGS, ROWS, ROW_JACOBIANS = range(5)
PRESENT, THETA = range(2)  # places in the settings
_IDENTITY = np.eye(4)


class VisualTerm:
    """The visual term at one object pose after another.

    Args:
        theta: Welsch's theta, in squares of sigmas.

    Attributes:
        handles: The reported pose, its whitening and loss, and room for the term's weighted rows.
    """

    def __init__(self, theta: float) -> None:
        settings = np.array([0.0, theta])
        self.handles = Handles(np.eye(4), np.zeros((6, 6)), settings, np.zeros(6), np.zeros((6, 6)))

    def place(self, T_wo_visual: np.ndarray | None, whitening: np.ndarray) -> None:
        """Begin a frame.

        Args:
            T_wo_visual: The pose that the tracker reports, (4, 4), or None.
            whitening: R with R'R the information about it, (6, 6), rotation first.
        """
        seen = T_wo_visual is not None
        place_visual(seen, T_wo_visual if seen else _IDENTITY, whitening, self.handles.table)


@compiled
def place_visual(seen: bool, T_wo_visual: Any, whitening: Any, visual: Any) -> None:
    """Begin a frame: see ``VisualTerm.place``; where no pose is ``seen``, T_wo_visual is any matrix."""
    array1(visual, SETTINGS, np.float64)[PRESENT] = seen
    copy_matrix(T_wo_visual, array2(visual, POSE, np.float64))
    copy_matrix(whitening, array2(visual, WHITENING, np.float64))


@compiled
def visual_loss(T_wo: Any, visual: Any) -> float:
    """Loss rho(e) of the term at T_wo (4, 4); 0 where there is no visual pose."""
    settings = array1(visual, SETTINGS, np.float64)
    if settings[PRESENT] == 0.0:
        return 0.0
    return -settings[THETA] * np.expm1(-_whitened(T_wo, visual, np.empty(6)))  # type: ignore[no-any-return]


@compiled
def visual_rows(T_wo: Any, visual: Any) -> float:
    """Fill the term's weighted rows and their Jacobian for T_wo (4, 4).

    Returns:
        The weight rho'(e) that the loss leaves; 0 where there is no visual pose.
    """
    rows, jacobians = array1(visual, ROWS, np.float64), array2(visual, ROW_JACOBIANS, np.float64)
    if array1(visual, SETTINGS, np.float64)[PRESENT] == 0.0:
        rows[:] = 0.0
        jacobians[:] = 0.0
        return 0.0
    r, J = np.empty(6), np.empty((6, 6))
    weight = np.exp(-_whitened(T_wo, visual, r))
    inverse_left_jacobian(r, J)
    whitening, scale = array2(visual, WHITENING, np.float64), np.sqrt(weight)
    for i in range(6):
        rows[i] *= scale
        for j in range(6):
            total = 0.0
            for k in range(6):
                total += whitening[i, k] * J[k, j]
            jacobians[i, j] = -scale * total
    return weight  # type: ignore[no-any-return]


@compiled
def _whitened(T_wo: Any, visual: Any, r: Any) -> float:
    """Residual into ``r`` (6,), whitened into the rows; returns e / theta."""
    log_between(T_wo, array2(visual, POSE, np.float64), r)
    whitening, rows = array2(visual, WHITENING, np.float64), array1(visual, ROWS, np.float64)
    e = 0.0
    for i in range(6):
        rows[i] = 0.0
        for j in range(6):
            rows[i] += whitening[i, j] * r[j]
        e += rows[i] * rows[i]
    return e / array1(visual, SETTINGS, np.float64)[THETA]  # type: ignore[no-any-return]


def visual_factor(
    key: int, T_wo_visual: gtsam.Pose3, noise: gtsam.noiseModel.Base
) -> gtsam.PriorFactorPose3:
    """Hold the object pose at the visual tracker's.

    Args:
        key: Key of the object pose T_wo.
        T_wo_visual: Pose the tracker reports.
        noise: Noise model of dimension 6, rotation first.
    """
    return gtsam.PriorFactorPose3(key, T_wo_visual, noise)
