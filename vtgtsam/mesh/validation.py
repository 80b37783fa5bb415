# SPDX-License-Identifier: MIT
"""Meshes that no distance field can be made of, or that are not in metres, are refused here and nowhere else."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .. import limits
from ..exceptions import MeshError

if TYPE_CHECKING:
    import trimesh

LARGEST_EXTENT = 2.0  # [m], nothing that a hand holds is larger
LARGE_EXTENT = 0.5  # [m], few things that a hand holds are larger
SMALLEST_EXTENT = 1e-3  # [m]
SMALLEST_VOLUME = 1e-6  # of the cube of the longest extent: a sheet of paper has 2e-4
LARGEST_LID = 0.35  # of the surface: what is open further is a sheet, not a body with a hole


def check_faces(vertices: np.ndarray, faces: np.ndarray, name: str = "the mesh") -> None:
    """Refuse more than there is room for, and faces with vertices that there are not.

    Raises:
        MeshError: It says which and what to do.
    """
    limits.check(len(faces), limits.FACES, f"faces in {name}", MeshError)
    limits.check(len(vertices), limits.VERTICES, f"vertices in {name}", MeshError)
    if len(faces) == 0:
        return
    lowest, highest = int(np.min(faces)), int(np.max(faces))
    if lowest < 0 or highest >= len(vertices):
        raise MeshError(
            f"{name} has faces with vertices {lowest} to {highest}, but it has {len(vertices)} vertices; "
            "export it again"
        )


def check_geometry(vertices: np.ndarray, faces: np.ndarray, name: str = "the mesh") -> None:
    """Refuse a mesh without triangles, or with coordinates or vertices that there are not.

    Raises:
        MeshError: It says which and what to do.
    """
    if len(faces) == 0 or len(vertices) == 0:
        raise MeshError(f"{name} holds no triangles; export the object as a triangle mesh")
    if not np.isfinite(vertices).all():
        raise MeshError(f"{name} has vertices that are not finite; export it again")
    check_faces(vertices, faces, name)


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


def size_doubts(vertices: np.ndarray) -> list[str]:
    """A sentence where a mesh is longer than what a hand holds, though it may be in metres."""
    longest = float(np.ptp(vertices, axis=0).max())
    if longest <= LARGE_EXTENT:
        return []
    return [
        f"the mesh is {longest:.3g} m long, and few things that a hand holds are longer than "
        f"{LARGE_EXTENT:g} m: is it in metres? a scale of 0.1 or 0.01 (--scale) would make decimetres "
        "or centimetres metres"
    ]


def check_volume(mesh: trimesh.Trimesh, volume: float) -> None:
    """Refuse a mesh that encloses nothing.

    Raises:
        MeshError: Its volume is none.
    """
    if volume < SMALLEST_VOLUME * float(mesh.extents.max()) ** 3:
        raise MeshError("the mesh has no volume: it is flat; give it a thickness")


def check_opening(lid: float, area: float, width: float) -> None:
    """Refuse a mesh that is open over so much of its surface that closing it would invent the object.

    Args:
        lid: Area that would close it [m^2].
        area: Area of its faces [m^2].
        width: Width of the widest opening [m].

    Raises:
        MeshError: It is more of a sheet than of a body.
    """
    if lid > LARGEST_LID * area:
        raise MeshError(
            f"the mesh is open: {width * 1e3:.0f} mm wide, and closing it would add {100 * lid / area:.0f} % to "
            "its surface; close it in a mesh editor, or give a shell (a bowl, a sheet) a thickness"
        )
