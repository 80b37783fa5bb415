# SPDX-License-Identifier: MIT
"""Reading triangle meshes: the bare geometry of any file, and its hash."""

from __future__ import annotations

import hashlib
import io
import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .. import limits
from ..exceptions import MeshError
from ..input.plain import plain
from ..input.text import read_bytes
from .validation import check_faces, check_geometry

if TYPE_CHECKING:
    import trimesh

ALONE = (".obj", ".ply", ".stl", ".off", ".glb")  # formats that say a whole shape in one file
ARCHIVES = (".zip", ".gz", ".bz2", ".tar", ".tgz", ".xz", ".zst", ".7z")


def read_mesh(path: str | Path) -> trimesh.Trimesh:
    """The geometry of a mesh file, one mesh with merged vertices, in the file's own unit and frame.

    Texture seams are closed (vertices that differ in nothing but texture or normal are merged) and
    the geometries of a scene are put together, each at its place in the scene.

    Raises:
        MeshError: The file cannot be read or holds no triangles.
    """
    path = Path(path)
    if not path.is_file():
        raise MeshError(f"there is no mesh file {path}")
    suffix = path.suffix.lower()
    if suffix in ARCHIVES:
        raise MeshError(f"{path} is an archive; unpack it and give the mesh in it")
    content = read_bytes(path, limits.MESH_BYTES, MeshError)
    with _quiet(), warnings.catch_warnings(action="ignore"):
        return _loaded(path, suffix, content)


@contextmanager
def _quiet() -> Iterator[None]:
    """The library logs tracebacks of what it gets over."""
    logger = logging.getLogger("trimesh.util")  # of all its loaders
    before, logger.disabled = logger.disabled, True
    try:
        yield
    finally:
        logger.disabled = before


def _loaded(path: Path, suffix: str, content: bytes) -> trimesh.Trimesh:
    import trimesh

    try:
        # From bytes, so that no other file is opened: of a shape nothing else matters.
        source = io.BytesIO(content) if suffix in ALONE else path
        loaded = trimesh.load_scene(source, file_type=suffix.removeprefix("."), process=False)
        for geometry in loaded.geometry.values():
            if hasattr(geometry, "faces"):  # before anything computes with them
                check_faces(geometry.vertices, geometry.faces, str(path))
        mesh = loaded.to_mesh()
        check_geometry(mesh.vertices, mesh.faces, str(path))
        return merged(mesh.vertices, mesh.faces)
    except MeshError:
        raise
    except MemoryError:
        raise MeshError(f"{path} asks for more memory than there is") from None
    except Exception as error:  # trimesh's loaders raise whatever their parsers do
        raise MeshError(
            f"{path} cannot be read as a mesh ({plain(error)}); convert it to OBJ, PLY or STL"
        ) from error


def merged(vertices: np.ndarray, faces: np.ndarray) -> trimesh.Trimesh:
    """The bare geometry, vertices at the same place merged."""
    import trimesh

    return trimesh.Trimesh(vertices=vertices, faces=faces, process=True)


def sha256_of(vertices: np.ndarray, faces: np.ndarray) -> str:
    """Hash of a mesh's geometry: vertices and faces in their order, nothing else."""
    digest = hashlib.sha256()
    digest.update(np.ascontiguousarray(vertices, dtype="<f8").tobytes())
    digest.update(np.ascontiguousarray(faces, dtype="<i8").tobytes())
    return digest.hexdigest()
