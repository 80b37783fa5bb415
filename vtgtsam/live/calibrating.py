# SPDX-License-Identifier: MIT
"""What a run that calibrates has found: said to people, and kept in a file."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterable
from fractions import Fraction
from pathlib import Path

import numpy as np

from ..calibration.calibration import Calibration
from ..calibration.online import OnlineCalibration


def instant_ns(time: float) -> int:
    """The last nanosecond that is no later than an instant [s]: a float has no room for nanoseconds since 1970."""
    return int(Fraction(time) * 10**9)


def kept(online: OnlineCalibration, runs: Iterable[str], path: Path | None) -> str:
    """Write what a run has found about its robot to a file, and give a sentence about it.

    Args:
        online: What calibrated; no frame is to come.
        runs: What tells the run's recordings from others (``run_of``): calibrating from them again with this
            calibration as the prior would count them twice, so that they are left out.
        path: The YAML file; None: none.
    """
    online.finish()
    found = online.calibration if online.learnt else None
    if found is None:
        nothing = "nothing was learnt of camera and joints"
        return nothing if path is None else f"{nothing}: {path} is not written"
    if path is None:
        return f"{_sentence(found)}. This is not kept: --calibration-out keeps it"
    dataclasses.replace(found, made_from=(*found.made_from, *runs)).to_yaml(path)
    return f"{_sentence(found)}. Wrote {path}: go on from it with --calibration {path}"


def _sentence(found: Calibration) -> str:
    turn, shift = np.linalg.norm(found.camera[:3]), np.linalg.norm(found.camera[3:])
    return (
        f"calibrated while it worked: the camera is off by {1000 * shift:.1f} mm and {np.rad2deg(turn):.1f} degrees, "
        f"joints by up to {np.rad2deg(np.abs(found.zeros).max()):.1f} degrees"
    )
