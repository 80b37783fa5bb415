# SPDX-License-Identifier: MIT
"""What a tracker gains from being handed the fused pose where it has lost itself.

The same grasps, recorded with a tracker that goes on by itself and with one that is told where to look. Its own poses
are what counts; fused they show whether the estimate gains too. Since the second tracker's poses owe touch something,
neither is tested against anything.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from joblib import Parallel, delayed

from vtgtsam import EstimatorConfig
from vtgtsam.evaluation.phases import AFTER, BEFORE
from vtgtsam.exceptions import RecordingError
from vtgtsam.vision.hand_back import BACK

from .replay import MEMORY, VIS, Replay, below, errors_mm, estimator, load
from .replay import run as replayed
from .report import save, table

METHODS: dict[str, EstimatorConfig] = {config.method: config for config in (VIS, MEMORY)}
LARGE_MM = 5.0


class Judged(NamedTuple):
    """A recording in one phase.

    Attributes:
        seen: Share of frames with a visual pose.
        errors_mm: ADD-S of each frame, by method.
    """

    seen: float
    errors_mm: dict[str, np.ndarray]


def run(folders: Sequence[Path], jobs: int) -> None:
    """Measure, and write ``hand_back.md`` and ``hand_back.json``.

    Args:
        folders: Recordings of both trackers.
        jobs: Processes to use.

    Raises:
        RecordingError: Something was recorded with one of them only.
    """
    replays = Parallel(jobs)(delayed(judged)(path) for path in below(folders))
    pairs = paired(replays)
    made = rows(pairs)
    words = (
        f"{len(pairs)} grasps, each recorded with both trackers. Medians over them of each one's median ADD-S, their "
        f"90th percentile and the largest; frames above {LARGE_MM:g} mm over all."
    )
    save("hand_back", f"{words}\n\n{table(made)}", {"rows": made}, {})


def judged(path: Path) -> tuple[str, str, dict[str, Judged]]:
    """A recording's name and tracker, and what it is like before and after the turn."""
    replay = load(path)
    errors = {
        method: errors_mm(
            replay.adds, replayed(estimator(replay, config), replay.frames), replay.truths
        )
        for method, config in METHODS.items()
    }
    tracker = str(replay.recording.info.get("tracker", "unknown"))
    return (
        path.stem,
        tracker,
        {phase: _in_phase(replay, errors, phase) for phase in (BEFORE, AFTER)},
    )


def _in_phase(replay: Replay, errors: dict[str, np.ndarray], phase: str) -> Judged:
    chosen = replay.phases == phase
    seen = [frame.T_wo_visual is not None for frame in replay.frames]
    return Judged(
        float(np.mean(np.array(seen)[chosen])),
        {m: of_method[chosen] for m, of_method in errors.items()},
    )


def paired(
    replays: Sequence[tuple[str, str, dict[str, Judged]]],
) -> list[tuple[dict[str, Judged], dict[str, Judged]]]:
    """Each grasp by the tracker alone, and by the one that is handed poses.

    Raises:
        RecordingError: One of the two is missing.
    """
    alone = {name: phases for name, tracker, phases in replays if not tracker.endswith(BACK)}
    told = {name: phases for name, tracker, phases in replays if tracker.endswith(BACK)}
    if not alone or alone.keys() != told.keys():
        odd = sorted(alone.keys() ^ told.keys())
        raise RecordingError(
            f"expected each grasp with a tracker and with the same one named {BACK!r}, got "
            + (f"only one of the two for {', '.join(odd)}" if odd else "no recording")
        )
    return [(alone[name], told[name]) for name in sorted(alone)]


def rows(pairs: Sequence[tuple[dict[str, Judged], dict[str, Judged]]]) -> list[dict[str, Any]]:
    """A row a phase, method and tracker."""
    return [
        _row(phase, method, tracker, [pair[k][phase] for pair in pairs])
        for phase in (BEFORE, AFTER)
        for method in METHODS
        for k, tracker in enumerate(("by itself", "handed our pose"))
    ]


def _row(phase: str, method: str, tracker: str, grasps: Sequence[Judged]) -> dict[str, Any]:
    errors = [grasp.errors_mm[method] for grasp in grasps]
    medians = np.array([np.median(e) for e in errors])
    return {
        "when": phase,
        "method": method,
        "tracker": tracker,
        "with a visual pose [%]": 1e2 * float(np.mean([grasp.seen for grasp in grasps])),
        "median [mm]": float(np.median(medians)),
        "90 % [mm]": float(np.percentile(medians, 90)),
        "largest [mm]": float(medians.max()),
        "above 5 mm [%]": 1e2 * float(np.mean(np.concatenate(errors) > LARGE_MM)),
    }
