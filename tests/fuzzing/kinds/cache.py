# SPDX-License-Identifier: MIT
"""Stored fields, and entries of the cache."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import numpy as np
from held_box import box_obj

from vtgtsam import GridSdf, build_sdf

from .kind import Kind, library


def _caches(folder: Path) -> list[bytes]:
    os.environ["VTGTSAM_CACHE"] = str(folder / "cache")
    (folder / "box.obj").write_bytes(box_obj())
    grid = build_sdf(folder / "box.obj", resolution=8)
    grid.save(folder / "field.npz")
    (entry,) = (folder / "cache" / "sdf").glob("*.npz")
    return [entry.read_bytes(), (folder / "field.npz").read_bytes()]


def _use_cache(path: Path, folder: Path, rng: np.random.Generator) -> str:
    os.environ["VTGTSAM_CACHE"] = str(folder / "cache")
    if path.name == "field.npz":
        return library(lambda: GridSdf.load(path))
    whole = build_sdf(folder / "box.obj", resolution=8).values
    (entry,) = (folder / "cache" / "sdf").glob("*.npz")
    shutil.copy(path, entry)
    found: list[np.ndarray] = []
    problem = library(lambda: found.append(build_sdf(folder / "box.obj", resolution=8).values))
    if not problem and not (found and np.array_equal(found[0], whole)):
        problem = "a damaged cache entry gives other values"
    return problem


CACHE = Kind(("entry.npz", "field.npz"), _caches, _use_cache)
