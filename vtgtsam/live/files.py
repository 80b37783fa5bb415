# SPDX-License-Identifier: MIT
"""Recordings of a run that goes on: each in a file of its own, and none is ever written over."""

from __future__ import annotations

import json
from collections.abc import Mapping
from datetime import UTC, datetime
from pathlib import Path

from ..calibration.calibration import Calibration
from ..calibration.sources import run_of
from ..config import EstimatorConfig
from ..exceptions import VtgtsamError
from ..hands.model import HandModel
from ..objects import ObjectModel
from ..recording import RecordingWriter, names
from ..recording.provenance import mesh_file, object_metadata


class Files:
    """Opens a run's recordings, NAME.mcap, NAME_1.mcap, ...

    Args:
        path: The first file's name.
        hand: The hand.
        obj: The object.
        config: The estimator's settings.
        hold: How long a visual pose counts again [s].
        more: What else the metadata say.
        calibration: The calibration that the run is corrected with.

    Attributes:
        calibration: That of the next recording; a run that calibrates sets it.
        runs: What tells the recordings so far from others, as ``Calibration.made_from`` has it.
    """

    def __init__(
        self,
        path: Path,
        hand: HandModel,
        obj: ObjectModel,
        config: EstimatorConfig,
        hold: float,
        more: Mapping[str, str],
        calibration: Calibration | None = None,
    ) -> None:
        self._path = path
        self._hand, self.calibration = hand, calibration
        self.runs: list[str] = []
        self._mesh = None if obj.mesh is None else mesh_file(obj)
        self._metadata = {
            **object_metadata(obj),
            "hand": hand.name,
            "config": json.dumps(config.model_dump(mode="json"), sort_keys=True),
            names.VISION_HOLD: repr(hold),
            names.VISUAL_COVARIANCE: "tracker",
            **more,
        }

    def check(self) -> None:
        """Refuse a name that cannot be written.

        Raises:
            VtgtsamError: It is no .mcap file, or its folder is not there.
        """
        if self._path.suffix != ".mcap":
            raise VtgtsamError(f"a recording is an .mcap file, got {self._path}")
        if not self._path.parent.is_dir():
            raise VtgtsamError(
                f"cannot record to {self._path}: there is no folder {self._path.parent}"
            )

    def next(self) -> Path:
        """The first name that is free."""
        path, number = self._path, 0
        while path.exists():
            number += 1
            path = self._path.with_stem(f"{self._path.stem}_{number}")
        return path

    def open(self) -> RecordingWriter:
        """Begin another recording."""
        started = datetime.now(UTC).isoformat(timespec="seconds")
        metadata = {**self._metadata, "started": started}
        self.runs.append(run_of(metadata))
        return RecordingWriter(
            self.next(),
            metadata,
            hand_xml=self._hand.xml,
            mesh=self._mesh,
            calibration=self.calibration,
        )
