# SPDX-License-Identifier: MIT
"""The estimates in other tools' formats: ``tum/`` for evo, ``bop/`` for bop_toolkit."""

from __future__ import annotations

import logging
import shutil
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow.parquet as pq

from . import store
from .atomic import replacing, write_text
from .bop import HEADER, bop_lines
from .estimates import POSE
from .tables import write_csv
from .tum import tum_lines

logger = logging.getLogger(__name__)

Description = Mapping[str, Any]


def export(out: Path, sequences: Sequence[Description], methods: Sequence[str]) -> None:
    """Write all estimates anew in other tools' formats; one sequence at a time is in memory.

    Args:
        out: The run's folder.
        sequences: Descriptions of the stored sequences, in the order of their ids.
        methods: Names of the methods.
    """
    for folder in ("tum", "bop"):
        shutil.rmtree(out / folder, ignore_errors=True)
    for about in sequences:
        for method in methods:
            lines = tum_lines(_rows(out, about["sequence"], method))
            write_text(out / "tum" / method / f"{about['sequence']}.txt", "".join(lines))
    _export_bop(out, sequences, methods)


def _export_bop(out: Path, sequences: Sequence[Description], methods: Sequence[str]) -> None:
    without = [about["sequence"] for about in sequences if not about["camera_poses"]]
    if without:
        logger.warning(
            "%d of %d sequences have no camera pose and are left out of bop/, the first is %s",
            len(without),
            len(sequences),
            without[0],
        )
    objects = {name: i for i, name in enumerate(sorted({a["object"] for a in sequences}), start=1)}
    scenes = [about for about in sequences if about["camera_poses"]]
    if not scenes:
        return
    numbered = [
        {"scene_id": scene, "sequence": about["sequence"], "obj_id": objects[about["object"]]}
        | {"object": about["object"]}
        for scene, about in enumerate(scenes, start=1)
    ]
    write_csv(out / "bop" / "scenes.csv", pd.DataFrame(numbered))
    for method in methods:
        with replacing(out / "bop" / f"{method}.csv") as temporary:
            with temporary.open("w", encoding="utf-8", newline="\n") as file:
                file.write(HEADER)
                for number, about in zip(numbered, scenes, strict=True):
                    rows = _rows(out, about["sequence"], method)
                    ids = number["scene_id"], number["obj_id"]
                    file.writelines(bop_lines(*ids, about["camera_poses"], rows))


def _rows(out: Path, sequence: str, method: str) -> list[dict[str, Any]]:
    """One method's times and poses of one sequence, frame by frame."""
    table = pq.read_table(
        store.estimates_path(out, sequence),
        columns=["time", *POSE],
        filters=[("method", "==", method)],
    )
    return table.to_pylist()  # type: ignore[no-any-return]
