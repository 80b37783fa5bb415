# SPDX-License-Identifier: MIT
"""A results folder's estimates by one method as a LeRobot dataset: an episode a sequence."""

from __future__ import annotations

import logging
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from ...atomic import LEFTOVER
from ...exceptions import VtgtsamError
from .. import store
from ..estimates import POSE, TANGENT
from .dataset import DatasetWriter
from .frames import episode, features, rate

logger = logging.getLogger(__name__)

TASK = "hold the {object}"

_COLUMNS = ["method", "time", *POSE, *(f"cov_{n}_{n}" for n in TANGENT), "status", "contacts"]


@dataclass(frozen=True)
class Exported:
    """What was written: how many episodes and frames, at what rate, of which method."""

    episodes: int
    frames: int
    fps: int
    method: str


def export_lerobot(
    results: Path,
    out: Path,
    method: str | None = None,
    fps: int | None = None,
    task: str = TASK,
) -> Exported:
    """Write estimates as a dataset that LeRobot 0.4 and later load.

    Args:
        results: Folder that ``evaluate`` wrote.
        out: The dataset's folder, which is made; it is whole or not there.
        method: Whose estimates; None: the one with memory where it is there, else the last one's by name.
        fps: Frames a second; None: the whole number that comes closest to the first sequence's.
        task: What is done in an episode, in words; ``{object}`` becomes the object's name.

    Raises:
        VtgtsamError: There is nothing to export, ``out`` is there already, or hands differ.
    """
    if out.exists():
        raise VtgtsamError(f"{out} is there already; give another folder for the dataset")
    names = sorted(path.stem for path in (results / "estimates").glob("*.parquet"))
    if not names:
        raise VtgtsamError(f"{results} holds no estimates; give a folder that `evaluate` wrote")
    rows, about = _read(results, names[0])
    method = _chosen(method, {row["method"] for row in rows})
    if fps is None:
        fps = rate([row["time"] for row in rows if row["method"] == method])
    temporary = out.with_name(f".{out.name}.{os.getpid()}{LEFTOVER}")
    try:
        writer = DatasetWriter(temporary, fps, features(about["pads"]))
        exported = _episodes(writer, results, names, about["pads"], method, task)
        os.rename(temporary, out)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
    return exported


def _episodes(
    writer: DatasetWriter,
    results: Path,
    names: Sequence[str],
    pads: Sequence[str],
    method: str,
    task: str,
) -> Exported:
    episodes = frames = 0
    for name in names:
        rows, about = _read(results, name)
        if about["pads"] != pads:
            raise VtgtsamError(
                f"{names[0]} and {name} are of hands with other pads ({len(pads)} and "
                f"{len(about['pads'])}); a LeRobot dataset has one hand: evaluate them into two folders"
            )
        columns = episode([row for row in rows if row["method"] == method], writer.fps)
        if not columns:
            logger.warning("%s has no pose by %s and is left out", name, method)
            continue
        writer.add(columns, task.replace("{object}", about["object"]), name)
        episodes += 1
        frames += len(next(iter(columns.values())))
    if not episodes:
        raise VtgtsamError(f"no sequence in {results} has a pose by {method}: nothing to export")
    writer.finish()
    return Exported(episodes, frames, writer.fps, method)


def _read(results: Path, name: str) -> tuple[list[Mapping[str, Any]], Mapping[str, Any]]:
    path = store.estimates_path(results, name)
    table, about = store.read_part(path, columns=_COLUMNS)
    if not {"pads", "object"} <= about.keys():
        raise VtgtsamError(f"{path} does not say its pads; `vtgtsam evaluate` makes it again")
    return table.to_pylist(), about


def _chosen(method: str | None, stored: set[str]) -> str:
    if method is None:
        return "vis+tac+pen+mem" if "vis+tac+pen+mem" in stored else max(stored)
    if method not in stored:
        raise VtgtsamError(f"no estimates by {method!r}; there are {', '.join(sorted(stored))}")
    return method
