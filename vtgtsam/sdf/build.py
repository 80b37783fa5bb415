# SPDX-License-Identifier: MIT
"""From a triangle mesh to a signed distance field on a grid.

At the nodes the distance is exact, and the sign is the winding number's, inside where it is above 1/2.
That is right also for meshes with holes, where the sign of a ray or of the closest face's normal is
not; holes wider than the grid's spacing get a lid, to which distances are taken too.
"""

from __future__ import annotations

import hashlib
import warnings
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from .. import limits
from ..cache import cached_arrays
from ..exceptions import MeshError
from ..input.door import reading
from ..mesh.orientation import outward
from ..mesh.reading import read_mesh, sha256_of
from ..mesh.validation import check_geometry, check_opening, check_size, size_doubts
from .grid import GridSdf

if TYPE_CHECKING:
    import trimesh

SMALL_HOLE = 3.0  # spacings of the grid
VERSION = 4  # of what is cached; raised when the same mesh would give other values


def build_sdf(
    mesh: trimesh.Trimesh | str | Path, resolution: int = 128, margin: float = 0.1
) -> GridSdf:
    """Signed distance field of a mesh, on a cube of ``resolution`` nodes a side around it.

    Takes about half a second for 128 nodes a side; the result is kept in the cache (``vtgtsam.cache``).
    A mesh with holes or with faces that look the wrong way gives a warning, and is closed and turned.

    Args:
        mesh: Triangle mesh [m], or the path of one.
        resolution: Nodes along each side of the cube, at least 2.
        margin: Room between mesh and cube on each side, as a fraction of the mesh's longest extent.

    Raises:
        MeshError: The mesh cannot be read, is empty, has no volume, is a sheet, or is not in metres.
    """
    if not isinstance(resolution, int | np.integer) or resolution < 2:
        raise ValueError(
            f"resolution must be a whole number of nodes a side, at least 2, got {resolution!r}"
        )
    limits.check(float(resolution) ** 3, limits.NODES, "nodes of a distance field", MeshError)
    if not (np.isfinite(margin) and margin >= 0):
        raise ValueError(f"margin must be a fraction of the mesh's extent, 0 or more, got {margin}")
    if isinstance(mesh, str | Path):
        mesh = read_mesh(mesh)
    if not hasattr(mesh, "faces"):
        raise ValueError(f"mesh must be a trimesh.Trimesh or a path, got {type(mesh).__name__}")
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces)
    name = getattr(mesh, "metadata", {}).get("name", "the mesh")
    check_geometry(vertices, faces, name)
    check_size(vertices, name)

    described = f"{VERSION} {sha256_of(vertices, faces)} {int(resolution)} {float(margin)!r}"
    key = hashlib.sha256(described.encode()).hexdigest()
    stored = cached_arrays("sdf", key, lambda: _compute(vertices, faces, int(resolution), margin))
    for problem in stored["problems"].tolist():
        warnings.warn(problem, stacklevel=2)
    return GridSdf(stored["values"], stored["lower"], stored["upper"])


def _compute(
    vertices: np.ndarray, faces: np.ndarray, resolution: int, margin: float
) -> dict[str, np.ndarray]:
    from ..surface import Surface
    from .openings import close_openings
    from .sign import winding_grid

    with reading("the mesh", MeshError):  # of shapes that nobody thought of
        mesh, closed, problems = outward(vertices, faces)
    lower, upper = mesh.bounds
    centre, half = (lower + upper) / 2, (0.5 + margin) * float((upper - lower).max())
    ticks = np.linspace(-half, half, resolution)
    V, F = np.asarray(mesh.vertices) - centre, np.asarray(mesh.faces, dtype=np.int64)
    distances = Surface(V, F).grid_distances(ticks)
    winding = winding_grid(V, F, ticks, distances, closed)
    if not closed:
        lids = close_openings(distances, winding, ticks)
        check_opening(lids.area, float(mesh.area), lids.width)
        problems = [_openness(lids.width, ticks[1] - ticks[0]), *problems]
    np.negative(distances, out=distances, where=winding > 0.5)
    return {
        "values": distances.astype(np.float32),
        "lower": centre - half,
        "upper": centre + half,
        "problems": np.array([*problems, *size_doubts(vertices)], dtype=str),
    }


def _openness(width: float, spacing: float) -> str:
    """How a mesh with holes was closed."""
    if width < SMALL_HOLE * spacing:
        return (
            "the mesh is not watertight: its distance field is closed across the holes, none wider than "
            f"{SMALL_HOLE * spacing * 1e3:.1f} mm, as the winding number sees them"
        )
    return (
        f"the mesh is not watertight: it is open about {width * 1e3:.0f} mm wide, and its distance field is closed "
        "there by a lid; if the real object is open, give its walls a thickness in a mesh editor"
    )
