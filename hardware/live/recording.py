# SPDX-License-Identifier: MIT
"""The file a live run is recorded to, and what it says of the run."""

from __future__ import annotations

import json

from vtgtsam.recording import RecordingWriter, names
from vtgtsam.recording.provenance import mesh_file, object_metadata

from .plan import Plan


def open_recording(
    plan: Plan, camera: str, started: str, hold: float, emulated: bool, infrared: bool
) -> RecordingWriter | None:
    """The file of a run, or None where it is not recorded.

    Args:
        plan: What the run does.
        camera: Name of its camera.
        started: When it began, in the form of ISO 8601.
        hold: How long fusion waits for late vision [s]; a replay waits as long.
        emulated: Whether hand and scene are simulated.
        infrared: Whether the tracker is given infrared images, which are not recorded.
    """
    if plan.record is None:
        return None
    metadata = {
        **object_metadata(plan.obj),
        "hand": plan.hand.name,
        "dataset": "live",
        "tracker": plan.tracker,
        "started": started,
        "config": json.dumps(plan.config.model_dump(mode="json"), sort_keys=True),
        "emulated": "yes" if emulated else "no",
        **({"infrared": "yes"} if infrared else {}),
        names.CAMERA: camera,
        names.VISUAL_COVARIANCE: "tracker",
        names.VISION_HOLD: repr(hold),
    }
    return RecordingWriter(
        plan.record,
        metadata,
        hand_xml=plan.hand.xml,
        mesh=mesh_file(plan.obj),
        calibration=plan.calibration,
    )
