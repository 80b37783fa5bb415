# SPDX-License-Identifier: MIT
"""A node's estimator, which calibrates its robot while it works where that is wanted."""

from __future__ import annotations

from pathlib import Path

from ..calibration.calibration import Calibration
from ..calibration.online import OnlineCalibration
from ..estimator import PoseEstimator
from ..exceptions import LiveError
from ..live.calibrating import instant_ns, kept
from ..live.files import Files
from ..live.fusion import Estimator
from ..live.inputs import Inputs
from ..live.slots import PoseSlot
from .settings import Given, Loaded


class Calibrating:
    """Makes the estimator, has its calibrations recorded, and keeps the last one.

    Args:
        given: The node's parameters.
        loaded: What they name.

    Attributes:
        estimator: The estimator.

    Raises:
        LiveError: Calibrating is wanted with settings without memory.
    """

    def __init__(self, given: Given, loaded: Loaded) -> None:
        self._out = Path(given.calibration_out) if given.calibration_out else None
        self._online: OnlineCalibration | None = None
        self._files: Files | None = None
        self._inputs: Inputs | None = None
        known = loaded.hand, loaded.obj, loaded.config, loaded.calibration
        if given.calibrate or self._out is not None:
            if not loaded.config.memory:
                raise LiveError(
                    f"calibrating needs settings with memory, those of {given.config!r} have none"
                )
            self._online = OnlineCalibration(*known, on_change=self._changed)
        self.estimator: Estimator = self._online or PoseEstimator(*known)

    def record_to(self, files: Files, inputs: Inputs) -> None:
        """Have each calibration recorded."""
        self._files, self._inputs = files, inputs

    def check(self, camera: PoseSlot) -> None:
        """Refuse a camera that moves, for its error would be another one everywhere.

        Raises:
            LiveError: It is to be calibrated, and moves.
        """
        if self._online is not None and camera.moves:
            raise LiveError("a camera that moves cannot be calibrated: leave --calibrate out")

    def end(self) -> str:
        """Keep what was found, when nothing is fused any more; a sentence, empty where nothing was to be found."""
        if self._online is None:
            return ""
        self._online.close()
        return kept(self._online, [] if self._files is None else self._files.runs, self._out)

    def _changed(self, time: float, calibration: Calibration) -> None:
        """In the thread that fuses."""
        if self._files is not None and self._inputs is not None:
            self._files.calibration = calibration  # of a recording that begins later
            self._inputs.record("calibration", instant_ns(time), calibration)
