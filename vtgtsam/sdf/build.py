# SPDX-License-Identifier: MIT
"""From a triangle mesh to a signed distance field on a grid.

The distance is exact; the sign is the winding number's, inside where it is above 1/2. That is right
also for meshes with holes, where the sign of a ray or of the closest face's normal is not.
"""

from __future__ import annotations

import hashlib
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..cache import cached_arrays
from ..exceptions import MeshError
from ..meshes import check_extent, merged, read_mesh, sha256_of
from .grid import GridSdf

if TYPE_CHECKING:
    import trimesh

VERSION = 1  # of what is cached; raised when the same mesh would give other values


def build_sdf(
    mesh: trimesh.Trimesh | str | Path, resolution: int = 128, margin: float = 0.1
) -> GridSdf:
    """Signed distance field of a mesh, on a cube of ``resolution`` nodes a side.

    Takes a second or two for 128 nodes; the result is kept in the cache (see ``vtgtsam.cache``).
    A mesh that is not watertight gives a warning and is closed as the winding number closes it.

    Args:
        mesh: Triangle mesh [m] with outward faces, or the path of one.
        resolution: Nodes along each side of the cube, at least 2.
        margin: Room between mesh and cube on each side, as a fraction of the mesh's longest extent.

    Raises:
        MeshError: The mesh cannot be read, is empty, has no volume, or is not in metres.
    """
    if resolution < 2:
        raise ValueError(f"resolution must be at least 2 nodes a side, got {resolution}")
    if not (np.isfinite(margin) and margin >= 0):
        raise ValueError(f"margin must be a fraction of the mesh's extent, 0 or more, got {margin}")
    if isinstance(mesh, str | Path):
        mesh = read_mesh(mesh)
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    if len(faces) == 0:
        raise MeshError("the mesh holds no triangles; export the object as a triangle mesh")
    check_extent(vertices)

    description = f"{VERSION} {sha256_of(vertices, faces)} {int(resolution)} {float(margin)!r}"
    key = hashlib.sha256(description.encode()).hexdigest()
    stored = cached_arrays("sdf", key, lambda: _compute(vertices, faces, int(resolution), margin))
    for problem in stored["problems"].tolist():
        warnings.warn(problem, stacklevel=2)
    return GridSdf(stored["values"], stored["lower"], stored["upper"])


def _compute(
    vertices: np.ndarray, faces: np.ndarray, resolution: int, margin: float
) -> dict[str, np.ndarray]:
    import igl

    mesh = merged(vertices, faces)
    problems = []
    if not mesh.is_watertight:
        problems.append(
            "the mesh is not watertight: its distance field is closed across the holes as the "
            "winding number sees them; close the holes in a mesh editor if it looks wrong"
        )
    lower, upper = mesh.bounds
    extents = upper - lower
    if abs(mesh.volume) < 1e-6 * extents.max() ** 3:
        raise MeshError("the mesh has no volume; a flat sheet needs a thickness to be held")
    centre, half = (lower + upper) / 2, (0.5 + margin) * extents.max()

    ticks = np.linspace(-half, half, resolution)
    nodes = np.stack(np.meshgrid(ticks, ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 3)
    V, F = np.ascontiguousarray(mesh.vertices - centre), np.asarray(mesh.faces, dtype=np.int64)
    squared, _, _ = igl.point_mesh_squared_distance(nodes, V, F)
    inside = igl.fast_winding_number(V, F, nodes) > 0.5
    values = np.where(inside, -np.sqrt(squared), np.sqrt(squared)).astype(np.float32)
    return {
        "values": values.reshape(resolution, resolution, resolution),
        "lower": centre - half,
        "upper": centre + half,
        "problems": np.array(problems, dtype=str),
    }
