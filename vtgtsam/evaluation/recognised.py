# SPDX-License-Identifier: MIT
"""Files of a results folder that older versions made, told by their content: they kept no list.

What is not surely ours is not named: a file too many costs a person's work, one too few a sentence.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import get_args

from ..config import Method
from ..exceptions import VtgtsamError
from ..input.text import read_yaml
from . import store
from .bop import HEADER
from .parquet import column_names, read_about

_COLUMNS = {
    store.SEQUENCES: {"sequence", "object", "tracker", "problem"},
    store.PER_SEQUENCE: {"sequence", "method", "phase", "adds_median_mm"},
    store.SUMMARY: {"object", "method", "phase", "adds_median_mm"},
    store.OVER_TIME: {"method", "time_start_s", "adds_median_mm"},
    store.TESTS: {"comparison", "p_holm"},
    store.TESTS_TIME: {"comparison", "p_holm"},
    store.TESTS_NOISE: {"comparison", "p_holm"},
    "bop/scenes.csv": {"scene_id", "sequence", "obj_id", "object"},
}
_METRICS = {"sequence", "method", "time_rel", "adds_m", "status"}
_PAGE = "<title>Evaluation of object poses</title>"
_TUM = "# time x y z qx qy qz qw\n"
_FIGURE = re.compile(
    r".+_(methods|time|noise_\w+|objects|objects_time|contacts|coverage|pose_errors|worst_\d+)\.png",
    re.DOTALL,
)
_RESOLUTION = b"pHYs" + 2 * (7874).to_bytes(4, "big") + b"\x01"  # 200 dpi in dots a metre
_HEAD = 4096  # [bytes]


def recognised(out: Path) -> set[str]:
    """Paths below ``out``, with "/", of files that an evaluation made."""
    return {path.relative_to(out).as_posix() for path in _found(out) if path.is_file()}


def _found(out: Path) -> Iterator[Path]:
    for name, columns in _COLUMNS.items():
        if columns <= set(_head(out / name).partition("\n")[0].strip().split(",")):
            yield out / name
    if column_names(out / store.METRICS) >= _METRICS:
        yield out / store.METRICS
    if _is_config(out / store.CONFIG):
        yield out / store.CONFIG
    if _PAGE in _head(out / store.REPORT):
        yield out / store.REPORT
    yield from (path for path in sorted((out / store.FIGURES).glob("*.png")) if _is_figure(path))
    for kind in ("estimates", "metrics"):
        parts = sorted((out / kind).glob("*.parquet"))
        yield from (path for path in parts if read_about(path) is not None)
    seals = sorted((out / store.MARK / "parts").glob("*.json"))
    yield from (path for path in seals if store.read_seal(path) is not None)
    for method in get_args(Method):
        trajectories = sorted((out / "tum" / method).glob("*.txt"))
        yield from (path for path in trajectories if _head(path).startswith(_TUM))
        if _head(out / "bop" / f"{method}.csv").startswith(HEADER):
            yield out / "bop" / f"{method}.csv"


def _head(path: Path) -> str:
    try:
        with path.open("rb") as file:
            return file.read(_HEAD).decode("utf-8", errors="replace")
    except OSError:
        return ""


def _is_config(path: Path) -> bool:
    """The effective configuration, which no one can give as ``--config``."""
    try:
        content = read_yaml(path)
    except VtgtsamError:
        return False
    return isinstance(content, dict) and {"version", "methods"} <= set(content)


def _is_figure(path: Path) -> bool:
    if not _FIGURE.fullmatch(path.name):
        return False
    with path.open("rb") as file:
        return _RESOLUTION in file.read(_HEAD)
