# SPDX-License-Identifier: MIT
"""What a tracker's images are worth: its poses alone, fused, and touch without any image.

Without images the first visual pose, a registration, is carried by the hand and fused with touch in the same way. Where
nothing slips in the hand that is hard to beat.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

import gtsam
import numpy as np
from joblib import Parallel, delayed

from vtgtsam import Estimate, EstimatorConfig, Measurement
from vtgtsam.evaluation.phases import AFTER, BEFORE
from vtgtsam.exceptions import RecordingError

from .replay import MEMORY, VIS, Replay, below, consistency, errors_mm, estimator, load
from .replay import run as replayed
from .report import save, table

REGISTERED = (0.2, 0.01)  # [rad], [m], sigma of a first pose that the hand has carried along
TRACKER, WITHOUT = "tracker alone", "touch without images"
INDEPENDENT, FUSED = "fused, images taken as independent", "fused"


class Judged(NamedTuple):
    """One method on one recording.

    Attributes:
        error_mm: Median ADD-S of the frames, by phase.
        worst_mm: Of the worst frame.
        nees: Mean NEES a degree of freedom, modulo symmetry, by phase.
        inside: Share of frames inside the 95 % region, by phase.
        seen: Share of frames with a visual pose.
    """

    error_mm: dict[str, float]
    worst_mm: float
    nees: dict[str, float]
    inside: dict[str, float]
    seen: float


def run(folders: Sequence[Path], jobs: int) -> None:
    """Measure, and write ``images.md`` and ``images.json``.

    Args:
        folders: Recordings.
        jobs: Processes to use.
    """
    found = Parallel(jobs)(delayed(judged)(path) for path in below(folders))
    made, each = rows(found), recordings(found)
    words = (
        f"{len(found)} recordings. Medians over them of each one's median ADD-S [mm] and mean NEES a degree of "
        "freedom, before / after the turn; frames inside 95 % regions; in how many the error after the turn is "
        "not larger than that of touch without images, and by how much it is larger at most."
    )
    text = f"{words}\n\n{table(made)}\n\nMedian ADD-S after the turn [mm]:\n\n{table(each)}"
    save("images", text, {"rows": made, "recordings": each}, {})


def judged(path: Path) -> tuple[str, str, dict[str, Judged]]:
    """A recording's name and camera, and each method on it."""
    replay = load(path)
    unlike = [replace(frame, visual_correlation=0.0) for frame in replay.frames]
    tried: dict[str, tuple[EstimatorConfig, Sequence[Measurement]]] = {
        TRACKER: (VIS, replay.frames),
        WITHOUT: (MEMORY, carried(replay.frames)),
        INDEPENDENT: (MEMORY, unlike),
        FUSED: (MEMORY, replay.frames),
    }
    camera = str(replay.recording.info.get("camera", "unknown"))
    return (
        path.stem,
        camera,
        {
            name: judge(replay, replayed(estimator(replay, config), frames))
            for name, (config, frames) in tried.items()
        },
    )


def carried(frames: Sequence[Measurement]) -> list[Measurement]:
    """The frames with the first visual pose in each, carried along by the hand.

    Raises:
        RecordingError: The first frame has none.
    """
    first = frames[0].T_wo_visual
    if first is None:
        raise RecordingError("the first frame must have a visual pose")
    T_wh = [frame.T_wh or gtsam.Pose3() for frame in frames]
    T_ho = T_wh[0].between(first)
    return [
        replace(
            frame,
            T_wo_visual=T.compose(T_ho),
            visual_sigma=REGISTERED,
            visual_covariance=None,
            visual_time=None,
            visual_correlation=0.0,
        )
        for frame, T in zip(frames, T_wh, strict=True)
    ]


def judge(replay: Replay, estimates: Sequence[Estimate]) -> Judged:
    """How far estimates are from the truth, and how far they say they are."""
    errors = errors_mm(replay.adds, estimates, replay.truths)
    said = consistency(replay, estimates)
    of = {phase: said.of(phase) for phase in (BEFORE, AFTER)}
    return Judged(
        {phase: float(np.median(errors[replay.phases == phase])) for phase in of},
        float(errors.max()),
        {phase: _mean(said.values[chosen]) for phase, chosen in of.items()},
        {phase: _mean(said.inside[chosen]) for phase, chosen in of.items()},
        float(np.mean([frame.T_wo_visual is not None for frame in replay.frames])),
    )


def _mean(values: np.ndarray) -> float:
    """NaN where there is none: the tracker had no pose in the phase."""
    return float(values.mean()) if len(values) else float("nan")


def recordings(found: Sequence[tuple[str, str, dict[str, Judged]]]) -> list[dict[str, Any]]:
    """A row a recording: the error after the turn of each method."""
    return [
        {"recording": name, "camera": camera, "seen [%]": 1e2 * methods[TRACKER].seen}
        | {method: judged.error_mm[AFTER] for method, judged in methods.items()}
        for name, camera, methods in found
    ]


def rows(found: Sequence[tuple[str, str, dict[str, Judged]]]) -> list[dict[str, Any]]:
    """A row a camera and method."""
    made = []
    for camera in sorted({camera for _, camera, _ in found}):
        of_camera = [methods for _, its, methods in found if its == camera]
        for name in (TRACKER, WITHOUT, INDEPENDENT, FUSED):
            results = [methods[name] for methods in of_camera]
            loss = np.array(
                [m[name].error_mm[AFTER] - m[WITHOUT].error_mm[AFTER] for m in of_camera]
            )
            made.append(
                {
                    "camera": camera,
                    "method": name,
                    "n": len(results),
                    "seen [%]": 1e2 * min(r.seen for r in results),
                    "ADD-S": _both([r.error_mm for r in results], 1.0, ".2f"),
                    "worst frame": max(r.worst_mm for r in results),
                    "NEES": _both([r.nees for r in results], 1.0, ".2f"),
                    "inside 95 % [%]": _both([r.inside for r in results], 1e2, ".0f"),
                    "not worse": int((loss <= 0.0).sum()),
                    "worse by": float(loss.max()),
                }
            )
    return made


def _both(values: Sequence[dict[str, float]], factor: float, form: str) -> str:
    return " / ".join(
        format(factor * float(np.nanmedian([v[phase] for v in values])), form)
        for phase in (BEFORE, AFTER)
    )
