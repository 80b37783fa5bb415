# SPDX-License-Identifier: MIT
"""A recording's frames, and the poses that methods gave the object in them."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import yaml

from ..config import EstimatorConfig
from ..exceptions import ConfigError, RecordingError
from ..frame import contact_bits
from ..input.text import read_yaml
from . import names

if TYPE_CHECKING:
    import gtsam

    from ..measurement import Measurement
    from ..recording import Recording

RATE = 30.0  # [Hz], of frames where there are no visual poses
_SAME_INSTANT = 1e-6  # [s]


@dataclass(frozen=True, eq=False)
class Track:
    """One method's answers.

    Attributes:
        name: The method.
        poses: T_wo in each frame, None where it gave none.
        statuses: Status in each frame; empty where it is not known.
        visual_weights: Weight of the visual pose in each frame; empty where statuses is.
        covariances: Covariance of each frame's pose, (6, 6), rotation first; empty where it is not known.
        config: Its settings, None where they are not known.
    """

    name: str
    poses: Sequence[gtsam.Pose3 | None]
    statuses: Sequence[str] = ()
    visual_weights: Sequence[float] = ()
    covariances: Sequence[np.ndarray] = ()
    config: EstimatorConfig | None = None

    @property
    def uses_touch(self) -> bool:
        """Whether contacts have drawn its poses."""
        return self.config is not None and "tac" in self.config.method


def recorded_tracks(recording: Recording) -> tuple[list[Measurement], list[Track]]:
    """Frames and what the recording itself says of the object: its tracker, and a live run.

    Raises:
        RecordingError: The recording lacks joints or contacts.
    """
    live = recording.estimates
    if live is not None:
        frames = recording.measurements(rate="recorded")
    elif recording.visual_poses is not None:
        frames = recording.measurements()
    else:
        return recording.measurements(rate=RATE), []
    seen = Track(names.TRACKER, [frame.T_wo_visual for frame in frames])
    if live is None:
        return frames, [seen]
    poses = live.at([frame.time for frame in frames])
    return frames, [seen, Track(names.LIVE, poses, config=_live_config(recording))]


def evaluated_tracks(recording: Recording, folder: Path) -> tuple[list[Measurement], list[Track]]:
    """Frames and all methods' estimates, from the folder that ``vtgtsam evaluate`` wrote.

    Raises:
        RecordingError: The folder has no estimates of this recording.
    """
    from ..recording.frames import evaluation_frames

    file = find_estimates(folder, recording.path)
    by_method = _rows_by_method(file)
    configs = _configs(folder)
    frames = evaluation_frames(recording)
    for rows in by_method.values():
        _check_same(recording, frames, rows, file)
    tracks = [_track(method, rows, configs.get(method)) for method, rows in by_method.items()]
    return frames, tracks


def find_estimates(folder: Path, recording: Path) -> Path:
    """The file with a recording's estimates; its name is the end of the recording's path.

    Raises:
        RecordingError: There is none.
    """
    path = recording.resolve()
    parts = (*path.parent.parts[1:], path.name.removesuffix(".mcap"))
    for start in range(len(parts)):  # the longest name first: it says most
        file = folder / "estimates" / f"{'__'.join(parts[start:])}.parquet"
        if len(file.name) < 255 and file.is_file():
            return file
    there = sorted(file.stem for file in (folder / "estimates").glob("*.parquet"))
    raise RecordingError(
        f"{folder} has no estimates of {recording}; it has "
        f"{', '.join(there[:5]) + (', ...' if len(there) > 5 else '') or 'none at all'}. "
        "Give the folder that `vtgtsam evaluate` wrote (--out)"
    )


def _rows_by_method(file: Path) -> dict[str, list[dict[str, Any]]]:
    from ..evaluation.store import read_part

    rows = read_part(file)[0].to_pylist()
    by_method: dict[str, list[dict[str, Any]]] = {}
    for row in rows:
        by_method.setdefault(row["method"], []).append(row)
    return by_method


def _check_same(
    recording: Recording, frames: list[Measurement], rows: list[dict[str, Any]], file: Path
) -> None:
    """Refuse estimates of another recording: their instants and contacts differ."""
    times = np.array([frame.time for frame in frames])
    same = len(rows) == len(frames) and np.allclose(
        times, [row["time"] for row in rows], rtol=0.0, atol=_SAME_INSTANT
    )
    if same:
        pads = recording.hand.pad_names
        bits = [contact_bits(frame.contacts, pads).tolist() for frame in frames]
        same = bits == [row["contacts"] for row in rows]
    if not same:
        raise RecordingError(
            f"{file} belongs to another recording than {recording.path}: times or contacts differ; "
            "evaluate this one, or give the right folder"
        )


def _track(method: str, rows: list[dict[str, Any]], config: EstimatorConfig | None) -> Track:
    from ..evaluation.estimates import covariances, poses

    return Track(
        method,
        poses(rows),
        [row["status"] for row in rows],
        [row["visual_weight"] for row in rows],
        covariances(rows),
        config,
    )


def _configs(folder: Path) -> dict[str, EstimatorConfig]:
    """Each method's settings, as far as the folder says; an interrupted evaluation does not."""
    from ..evaluation.methods import stored_config

    try:
        content = read_yaml(folder / "config.yaml", ConfigError)
        configs = {name: stored_config(entry) for name, entry in content["methods"].items()}
    except (OSError, ValueError, KeyError, TypeError, AttributeError, yaml.YAMLError, ConfigError):
        return {}
    return {name: config for name, config in configs.items() if config is not None}


def _live_config(recording: Recording) -> EstimatorConfig | None:
    from ..evaluation.methods import stored_config

    try:
        return stored_config(json.loads(recording.info["config"]))
    except (KeyError, ValueError, TypeError, AttributeError):  # none, or not ours
        return None
