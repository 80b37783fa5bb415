# SPDX-License-Identifier: MIT
"""Meshes in every format."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import trimesh

from vtgtsam import build_sdf

from .kind import Kind, command, library


def _meshes(folder: Path) -> list[bytes]:
    box = trimesh.creation.box(extents=(0.04, 0.06, 0.08)).subdivide()
    kinds = ("obj", "ply_ascii", "ply", "stl", "stl_ascii", "glb", "off")
    exports = [
        box.export(file_type="ply", encoding="ascii")
        if kind == "ply_ascii"
        else box.export(file_type=kind)
        for kind in kinds
    ]
    return [data.encode() if isinstance(data, str) else data for data in exports]


def _use_mesh(path: Path, folder: Path, rng: np.random.Generator) -> str:
    os.environ["VTGTSAM_CACHE"] = str(folder / "cache")
    return library(lambda: build_sdf(path, resolution=8)) or command(
        "check-mesh", path, "--resolution", 8
    )


MESH = Kind(("a.obj", "a.ply", "b.ply", "a.stl", "b.stl", "a.glb", "a.off"), _meshes, _use_mesh)
