# SPDX-License-Identifier: MIT
"""Reading triangle meshes, and refusing those no distance field can be made of."""

from __future__ import annotations

import hashlib
import io
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .. import limits
from ..exceptions import MeshError
from ..input.plain import plain
from ..input.text import read_bytes

if TYPE_CHECKING:
    import trimesh

ALONE = (".obj", ".ply", ".stl", ".off", ".glb")  # formats that say a whole shape in one file
ARCHIVES = (".zip", ".gz", ".bz2", ".tar", ".tgz", ".xz", ".zst", ".7z")

LARGEST_EXTENT = 2.0  # [m], nothing that a hand holds is larger
SMALLEST_EXTENT = 1e-3  # [m]


def read_mesh(path: str | Path) -> trimesh.Trimesh:
    """The geometry of a mesh file, one mesh with merged vertices, in the file's own unit and frame.

    Texture seams are closed (vertices that differ in nothing but texture or normal are merged) and
    the geometries of a scene are put together, each at its place in the scene.

    Raises:
        MeshError: The file cannot be read or holds no triangles.
    """
    import trimesh

    path = Path(path)
    if not path.is_file():
        raise MeshError(f"there is no mesh file {path}")
    suffix = path.suffix.lower()
    if suffix in ARCHIVES:
        raise MeshError(f"{path} is an archive; unpack it and give the mesh in it")
    content = read_bytes(path, limits.MESH_BYTES, MeshError)
    try:
        # From bytes, so that no other file is opened: of a shape nothing else matters.
        source = io.BytesIO(content) if suffix in ALONE else path
        loaded = trimesh.load_scene(source, file_type=suffix.removeprefix("."), process=False)
        for geometry in loaded.geometry.values():
            _check_faces(geometry, str(path))
        mesh = loaded.to_mesh()
    except MeshError:
        raise
    except MemoryError:
        raise MeshError(f"{path} asks for more memory than there is") from None
    except Exception as error:  # trimesh's loaders raise whatever their parsers do
        raise MeshError(
            f"{path} cannot be read as a mesh ({plain(error)}); convert it to OBJ, PLY or STL"
        ) from error
    check_geometry(mesh.vertices, mesh.faces, str(path))
    return merged(mesh.vertices, mesh.faces)


def _check_faces(geometry: object, name: str) -> None:
    """Refuse faces that name vertices which are not there, before anything computes with them."""
    vertices, faces = getattr(geometry, "vertices", None), getattr(geometry, "faces", None)
    if vertices is None or faces is None or len(faces) == 0:
        return
    limits.check(len(faces), limits.FACES, f"faces in {name}", MeshError)
    limits.check(len(vertices), limits.VERTICES, f"vertices in {name}", MeshError)
    lowest, highest = int(np.min(faces)), int(np.max(faces))
    if lowest < 0 or highest >= len(vertices):
        raise MeshError(
            f"{name} has faces with vertices {lowest} to {highest}, but it has {len(vertices)} vertices; "
            "export it again"
        )


def merged(vertices: np.ndarray, faces: np.ndarray) -> trimesh.Trimesh:
    """The bare geometry, vertices at the same place merged."""
    import trimesh

    return trimesh.Trimesh(vertices=vertices, faces=faces, process=True)


def check_geometry(vertices: np.ndarray, faces: np.ndarray, name: str = "the mesh") -> None:
    """Refuse a mesh without triangles or with coordinates that are not finite.

    Raises:
        MeshError: It says which and what to do.
    """
    if len(faces) == 0 or len(vertices) == 0:
        raise MeshError(f"{name} holds no triangles; export the object as a triangle mesh")
    if not np.isfinite(vertices).all():
        raise MeshError(f"{name} has vertices that are not finite; export it again")


def check_size(vertices: np.ndarray, name: str = "the mesh") -> None:
    """Refuse a mesh that is not in metres.

    Raises:
        MeshError: It is longer than 2 m or shorter than 1 mm.
    """
    longest = float(np.ptp(vertices, axis=0).max())
    if longest > LARGEST_EXTENT:
        raise MeshError(
            f"{name} is {longest:.4g} m long, more than {LARGEST_EXTENT:g} m: it is probably in "
            "millimetres or centimetres; load it with scale=0.001 or 0.01 (on the command line "
            "--scale 0.001 or 0.01)"
        )
    if longest < SMALLEST_EXTENT:
        raise MeshError(
            f"{name} is {longest:.2g} m long, less than {SMALLEST_EXTENT:g} m: it is not in "
            "metres; load it with the scale that makes it metres (--scale on the command line)"
        )


def sha256_of(vertices: np.ndarray, faces: np.ndarray) -> str:
    """Hash of a mesh's geometry: vertices and faces in their order, nothing else."""
    digest = hashlib.sha256()
    digest.update(np.ascontiguousarray(vertices, dtype="<f8").tobytes())
    digest.update(np.ascontiguousarray(faces, dtype="<i8").tobytes())
    return digest.hexdigest()
