# SPDX-License-Identifier: MIT
"""Visuo-tactile object pose estimation for multi-finger robot hands, as a GTSAM factor graph.

The public names load on first use, so that ``vtgtsam --help`` need not wait for GTSAM and MuJoCo.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from .calibration.calibrate import calibrate as calibrate
    from .calibration.calibration import Calibration as Calibration
    from .config import EstimatorConfig as EstimatorConfig
    from .estimate import Estimate as Estimate
    from .estimator import PoseEstimator as PoseEstimator
    from .evaluation.run import evaluate as evaluate
    from .exceptions import VtgtsamError as VtgtsamError
    from .factors.checked import checked_factor as checked_factor
    from .graph import build_graph as build_graph
    from .hands.model import HandModel as HandModel
    from .hands.model import load_hand as load_hand
    from .hands.pads import Pad as Pad
    from .hands.pads import PadSet as PadSet
    from .measurement import Measurement as Measurement
    from .metrics import adds as adds
    from .objects import ObjectModel as ObjectModel
    from .objects import load_object as load_object
    from .recording import Recording as Recording
    from .recording import read_recording as read_recording
    from .sdf.build import build_sdf as build_sdf
    from .sdf.grid import GridSdf as GridSdf
    from .sdf.search import ClosestPoints as ClosestPoints

__version__ = "0.1.0"

_MODULES = {
    "Calibration": "calibration.calibration",
    "calibrate": "calibration.calibrate",
    "EstimatorConfig": "config",
    "Estimate": "estimate",
    "PoseEstimator": "estimator",
    "evaluate": "evaluation.run",
    "VtgtsamError": "exceptions",
    "checked_factor": "factors.checked",
    "build_graph": "graph",
    "HandModel": "hands.model",
    "load_hand": "hands.model",
    "Measurement": "measurement",
    "adds": "metrics",
    "ObjectModel": "objects",
    "load_object": "objects",
    "Pad": "hands.pads",
    "PadSet": "hands.pads",
    "Recording": "recording",
    "read_recording": "recording",
    "build_sdf": "sdf.build",
    "GridSdf": "sdf.grid",
    "ClosestPoints": "sdf.search",
}

__all__ = [*_MODULES, "__version__"]


def __getattr__(name: str) -> Any:
    if name not in _MODULES:
        raise AttributeError(f"module 'vtgtsam' has no attribute {name!r}")
    try:
        value = getattr(importlib.import_module(f".{_MODULES[name]}", __name__), name)
    except ModuleNotFoundError as error:
        from .extras import explained

        raise explained(error, f"vtgtsam.{name} needs") from error
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted(__all__)
