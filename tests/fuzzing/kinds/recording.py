# SPDX-License-Identifier: MIT
"""Bytes of a recording."""

from __future__ import annotations

from pathlib import Path

import gtsam
import numpy as np
from held_box import write_grasp

from vtgtsam import read_recording

from .kind import Kind, command, library


def _recordings(folder: Path) -> list[bytes]:
    write_grasp(folder / "a.mcap", frames=6)
    write_grasp(folder / "b.mcap", frames=3, truth=False, silent=(1, 2))
    return [(folder / name).read_bytes() for name in ("a.mcap", "b.mcap")]


def content(path: Path) -> list[object]:
    """All that the estimator gets from a recording."""
    recording = read_recording(path)
    frames = [
        (m.time, _plain(m.contacts), _plain(m.joints), _plain(m.T_wh), _plain(m.T_wo_visual))
        for m in recording.measurements()
    ]
    return [frames, recording.object.sha256, recording.hand.pad_names, recording.warnings]


def _plain(value: object) -> object:
    """Numbers as lists, which compare."""
    if isinstance(value, gtsam.Pose3):
        value = value.matrix()
    return value.tolist() if isinstance(value, np.ndarray) else value


_WHOLE: list[list[object]] = []  # the seeds' content


def _use_recording(path: Path, folder: Path, rng: np.random.Generator) -> str:
    if not _WHOLE:
        _WHOLE.extend(content(folder / name) for name in ("a.mcap", "b.mcap"))
    found: list[list[object]] = []

    def read() -> None:
        found.append(content(path))

    problem = library(read)
    if not problem and found and found[0][-1] == [] and found[0] not in _WHOLE:
        problem = "a changed recording is read without a word, and gives other measurements"
    return problem or command("inspect", path)


RECORDING = Kind(("a.mcap", "b.mcap"), _recordings, _use_recording)
