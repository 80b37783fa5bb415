# SPDX-License-Identifier: MIT
"""The estimates in other tools' formats: ``tum/`` for evo, ``bop/`` for bop_toolkit."""

from __future__ import annotations

import logging
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow.parquet as pq

from ..atomic import LEFTOVER, replacing, write_text
from . import store
from .bop import HEADER, bop_lines
from .engine import run_tasks
from .estimates import POSE
from .tables import write_csv
from .tum import tum_lines

logger = logging.getLogger(__name__)

Description = Mapping[str, Any]


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
    for folder in ("tum", "bop"):
        shutil.rmtree(out / folder, ignore_errors=True)
    scenes = _numbered(out, sequences, tuple(methods))
    for _ in run_tasks(_export_sequence, scenes, jobs, scheduler):
        pass
    with_poses = [scene for scene in scenes if scene.ids is not None]
    if with_poses:
        _write_scenes(out, with_poses)
        for method in methods:
            _join_bop(out, method, [scene.ids[0] for scene in with_poses if scene.ids])


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


def _export_sequence(scene: _Scene) -> None:
    """Write one sequence's trajectories, and its lines of each of BOP's files to a file of their own."""
    for method in scene.methods:
        rows = _rows(scene.out, scene.about["sequence"], method)
        path = scene.out / "tum" / method / f"{scene.about['sequence']}.txt"
        write_text(path, "".join(tum_lines(rows)))
        if scene.ids is not None:
            lines = bop_lines(*scene.ids, scene.about["camera_poses"], rows)
            write_text(_bop_part(scene.out, method, scene.ids[0]), "".join(lines))


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
    write_csv(out / "bop" / "scenes.csv", pd.DataFrame(rows))


def _join_bop(out: Path, method: str, numbers: Sequence[int]) -> None:
    """Put the scenes' lines together, in order; one scene's at a time are in memory."""
    with replacing(out / "bop" / f"{method}.csv") as temporary:
        with temporary.open("w", encoding="utf-8", newline="\n") as file:
            file.write(HEADER)
            for number in numbers:
                part = _bop_part(out, method, number)
                file.write(part.read_text(encoding="utf-8"))
                part.unlink()


def _bop_part(out: Path, method: str, scene: int) -> Path:
    return out / "bop" / f".{method}.{scene}.csv{LEFTOVER}"


def _rows(out: Path, sequence: str, method: str) -> list[dict[str, Any]]:
    """One method's times and poses of one sequence, frame by frame."""
    table = pq.read_table(
        store.estimates_path(out, sequence),
        columns=["time", *POSE],
        filters=[("method", "==", method)],
    )
    return table.to_pylist()  # type: ignore[no-any-return]
