# SPDX-License-Identifier: MIT
"""The texture of an object whose mesh file has one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from vtgtsam import ObjectModel

if TYPE_CHECKING:
    import trimesh


@dataclass(frozen=True, eq=False)
class Skin:
    """A textured surface in the object frame; vertices along seams occur once for each side.

    Attributes:
        vertices: Shape (N, 3) [m].
        faces: Shape (F, 3).
        coordinates: Place of each vertex in the image, shape (N, 2), from the upper left corner (0, 0)
            to the lower right (1, 1).
        image: RGB, uint8, shape (height, width, 3).
    """

    vertices: np.ndarray
    faces: np.ndarray
    coordinates: np.ndarray
    image: np.ndarray


def find_skin(obj: ObjectModel) -> Skin | None:
    """The texture in the file that an object was loaded from, or None."""
    import trimesh

    if obj.source is None or not Path(obj.source).is_file():
        return None
    mesh = trimesh.load_scene(obj.source, process=False).to_mesh()
    image = _image(mesh)
    if image is None:
        return None
    u, v = np.asarray(mesh.visual.uv, dtype=np.float64).T  # from the lower left corner
    return Skin(
        np.asarray(mesh.vertices) * obj.scale - obj.origin,
        np.asarray(mesh.faces),
        np.column_stack([u, 1.0 - v]),
        image,
    )


def _image(mesh: trimesh.Trimesh) -> np.ndarray | None:
    """The picture on a mesh, or None."""
    visual = mesh.visual
    if visual.kind != "texture" or getattr(visual, "uv", None) is None:
        return None
    material = visual.material
    picture = getattr(material, "image", None) or getattr(material, "baseColorTexture", None)
    return None if picture is None else np.array(picture.convert("RGB"))
