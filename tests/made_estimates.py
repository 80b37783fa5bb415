# SPDX-License-Identifier: MIT
"""Stored estimates of an object that turns slowly in the hand, for exporters: needs no pandas, no MuJoCo."""

from pathlib import Path

import gtsam
import numpy as np

from vtgtsam.estimate import Estimate
from vtgtsam.evaluation import store
from vtgtsam.evaluation.estimates import estimates_table

METHODS = ("vis", "vis+tac+pen")


def write_estimates(
    out: Path, sequence: str, object: str, times: np.ndarray, pads: int = 3, silent: int = 0
) -> Path:
    """One sequence: the object rises by 1 cm/s and turns by 3 rad/s, and ``vis`` is 1 mm too high.

    Args:
        out: The results folder.
        sequence: Its id.
        object: The object's name.
        times: Instants of the estimates [s].
        pads: How many the hand has; pad k touches from instant k on.
        silent: How many estimates come before the first pose.
    """
    estimates = {
        method: [_estimate(t, n >= silent, 1e-3 * (method == "vis")) for n, t in enumerate(times)]
        for method in METHODS
    }
    contacts = [np.arange(pads) <= n for n in range(len(times))]
    about = {"sequence": sequence, "object": object, "pads": [f"pad_{k}" for k in range(pads)]}
    table = estimates_table(estimates, contacts)
    store.keep(out, sequence, table, table.select(["method", "time"]), about)
    return out


def true_pose(time: float) -> np.ndarray:
    """Where ``vis+tac+pen`` says the object is: x, y, z, qx, qy, qz, qw."""
    return np.array([0.1, 0.2, 0.01 * time, 0, 0, np.sin(1.5 * time), np.cos(1.5 * time)])


def _estimate(time: float, there: bool, height: float) -> Estimate:
    pose = gtsam.Pose3(gtsam.Rot3.Rz(3.0 * time), [0.1, 0.2, 0.01 * time + height])
    return Estimate(
        time=time,
        T_wo=pose if there else None,
        covariance=np.diag([1e-4, 4e-4, np.inf, 1e-6, 4e-6, 9e-6]),
        status="ok" if there else "waiting",
        faults=(),
        mode=None,
        events=(),
        iterations=1,
        error=0.0,
        visual_weight=1.0,
        pad_distances=np.zeros(3),
        pad_weights=np.zeros(3),
        contact_points_w=np.zeros((3, 3)),
    )
