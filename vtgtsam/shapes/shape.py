# SPDX-License-Identifier: MIT
"""One built-in object: a surface made by code, with the mass of the thing it stands for."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from .symmetry import Symmetry, moved

if TYPE_CHECKING:
    import trimesh


@dataclass(frozen=True)
class Shape:
    """A look-alike of a YCB object, of its published size and mass.

    Attributes:
        name: What people call it.
        ycb: The object of the YCB set it stands for.
        size_mm: Bounding box along x, y and z [mm].
        mass: Published mass [kg].
        build: Makes the surface, anywhere near the origin.
        symmetry: In BOP's form, about the centre of the bounding box; None where there is none.
    """

    name: str
    ycb: str
    size_mm: tuple[float, float, float]
    mass: float
    build: Callable[[], trimesh.Trimesh]
    symmetry: Symmetry | None = None

    def mesh(self) -> trimesh.Trimesh:
        """The closed surface [m] with the origin at the centre of its bounding box.

        Coordinates are rounded to float32, so that every mesh format stores them exactly.
        """
        import trimesh

        made = self.build()
        vertices = np.asarray(made.vertices - made.bounds.mean(axis=0), dtype=np.float32)
        return trimesh.Trimesh(vertices.astype(np.float64), made.faces, process=False)

    def symmetry_about(self, center: np.ndarray) -> Symmetry | None:
        """The symmetry where the bounding box's centre lies at ``center`` (3,) [m]."""
        return None if self.symmetry is None else moved(self.symmetry, center)
