# SPDX-License-Identifier: MIT
"""The estimates in other tools' formats: ``tum/`` for evo, ``bop/`` for bop_toolkit."""

from __future__ import annotations

import logging
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import pandas as pd

from ..atomic import replacing, write_text
from . import folder, store
from .bop import HEADER, bop_lines
from .engine import run_tasks
from .estimates import POSE
from .tables import write_csv
from .tum import tum_lines

logger = logging.getLogger(__name__)

Description = Mapping[str, Any]

_SCENES = "bop/scenes.csv"


@dataclass(frozen=True)
class _Scene:
    """One sequence to write in other tools' formats.

    Attributes:
        out: The run's folder.
        about: The stored sequence's description.
        methods: Names of the methods.
        ids: BOP's numbers of its scene and object, or None where no camera pose is known.
    """

    out: Path
    about: Description
    methods: tuple[str, ...]
    ids: tuple[int, int] | None


def export(
    out: Path,
    sequences: Sequence[Description],
    methods: Sequence[str],
    jobs: int = 1,
    scheduler: str | None = None,
) -> None:
    """Write all estimates anew in other tools' formats.

    Args:
        out: The run's folder.
        sequences: Descriptions of the stored sequences, in the order of their ids.
        methods: Names of the methods.
        jobs: Processes on this machine, each with one sequence at a time in memory.
        scheduler: Address of a Dask scheduler whose workers to use instead.
    """
    folder.release_below(out, "tum", "bop")
    scenes = _numbered(out, sequences, tuple(methods))
    folder.claim(out, _names(scenes))
    for _ in run_tasks(_export_sequence, scenes, jobs, scheduler):
        pass
    with_poses = [scene for scene in scenes if scene.ids is not None]
    if with_poses:
        _write_scenes(out, with_poses)
        for method in methods:
            _join_bop(out, method, [scene.ids[0] for scene in with_poses if scene.ids])
        folder.release(out, [_bop_part(*part) for part in _bop_parts(with_poses)])


def _numbered(
    out: Path, sequences: Sequence[Description], methods: tuple[str, ...]
) -> list[_Scene]:
    without = [about["sequence"] for about in sequences if not about["camera_poses"]]
    if without:
        logger.warning(
            "%d of %d sequences have no camera pose and are left out of bop/, the first is %s",
            len(without),
            len(sequences),
            without[0],
        )
    objects = {name: i for i, name in enumerate(sorted({a["object"] for a in sequences}), start=1)}
    numbers = count(1)
    return [
        _Scene(
            out,
            about,
            methods,
            (next(numbers), objects[about["object"]]) if about["camera_poses"] else None,
        )
        for about in sequences
    ]


def _names(scenes: Sequence[_Scene]) -> list[str]:
    """All files to be written, as paths below the run's folder."""
    trajectories = [_tum(scene, method) for scene in scenes for method in scene.methods]
    parts = _bop_parts(scenes)
    joined = [_SCENES, *(_bop(method) for method in scenes[0].methods)] if parts else []
    return [*trajectories, *(_bop_part(*part) for part in parts), *joined]


def _export_sequence(scene: _Scene) -> None:
    """Write one sequence's trajectories, and its lines of each of BOP's files to a file of their own."""
    for method in scene.methods:
        rows = _rows(scene.out, scene.about["sequence"], method)
        write_text(scene.out / _tum(scene, method), "".join(tum_lines(rows)))
        if scene.ids is not None:
            lines = bop_lines(*scene.ids, scene.about["camera_poses"], rows)
            write_text(scene.out / _bop_part(method, scene.ids[0]), "".join(lines))


def _write_scenes(out: Path, scenes: Sequence[_Scene]) -> None:
    rows = [
        {
            "scene_id": scene.ids[0],
            "sequence": scene.about["sequence"],
            "obj_id": scene.ids[1],
            "object": scene.about["object"],
        }
        for scene in scenes
        if scene.ids is not None
    ]
    write_csv(out / _SCENES, pd.DataFrame(rows))


def _join_bop(out: Path, method: str, numbers: Sequence[int]) -> None:
    """Put the scenes' lines together, in order; one scene's at a time are in memory."""
    with replacing(out / _bop(method)) as temporary:
        with temporary.open("w", encoding="utf-8", newline="\n") as file:
            file.write(HEADER)
            for number in numbers:
                part = out / _bop_part(method, number)
                file.write(part.read_text(encoding="utf-8"))


def _tum(scene: _Scene, method: str) -> str:
    return f"tum/{method}/{scene.about['sequence']}.txt"


def _bop(method: str) -> str:
    return f"bop/{method}.csv"


def _bop_part(method: str, scene: int) -> str:
    return f"bop/parts/{method}.{scene}.csv"


def _bop_parts(scenes: Sequence[_Scene]) -> list[tuple[str, int]]:
    """Method and scene of each file of one scene's lines."""
    return [(method, scene.ids[0]) for scene in scenes if scene.ids for method in scene.methods]


def _rows(out: Path, sequence: str, method: str) -> list[dict[str, Any]]:
    """One method's times and poses of one sequence, frame by frame."""
    table, _ = store.read_part(
        store.estimates_path(out, sequence), columns=["method", "time", *POSE]
    )
    return [row for row in table.to_pylist() if row["method"] == method]
