# SPDX-License-Identifier: MIT
"""Objects: a mesh in its frame o, its distance field, and where it came from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from .exceptions import MeshError
from .mesh.reading import read_mesh, sha256_of
from .mesh.symmetry import Symmetry, read_symmetry, shifted, symmetry_beside
from .sdf.build import build_sdf
from .sdf.grid import GridSdf

if TYPE_CHECKING:
    import trimesh


@dataclass(frozen=True, eq=False)
class ObjectModel:
    """An object that a hand holds.

    Attributes:
        name: What people call it.
        sdf: Signed distance field in the object frame.
        mesh: Surface in the object frame [m]; only metrics and pictures need it.
        symmetry: None, or the object's entry of BOP's ``models_info.json`` ("symmetries_discrete",
            "symmetries_continuous"; millimetres there), in the object frame.
        mass: Mass [kg] where it is known; only the simulator needs it.
        source: The built-in name or the path of the mesh it was loaded from.
        sha256: Hash of the mesh as it lies in its source (``vtgtsam.mesh.reading.sha256_of``).
        scale: Metres per unit of the source.
        origin: Origin of the object frame, in the source's frame and axes [m]:
            p_o = scale * p_source - origin.
    """

    name: str
    sdf: GridSdf
    mesh: trimesh.Trimesh | None = None
    symmetry: dict[str, Any] | None = None
    mass: float | None = field(default=None, kw_only=True)
    source: str | None = field(default=None, kw_only=True)
    sha256: str | None = field(default=None, kw_only=True)
    scale: float = field(default=1.0, kw_only=True)
    origin: tuple[float, float, float] = field(default=(0.0, 0.0, 0.0), kw_only=True)

    def __post_init__(self) -> None:
        if not isinstance(self.sdf, GridSdf):
            raise ValueError(
                f"object {self.name!r}: sdf must be a GridSdf, got {type(self.sdf).__name__}; build_sdf makes "
                "one of a mesh, and load_object the whole object"
            )
        if self.mesh is not None and not hasattr(self.mesh, "faces"):
            raise ValueError(
                f"object {self.name!r}: mesh must be a trimesh.Trimesh or None, got {type(self.mesh).__name__}"
            )
        if self.symmetry is not None:
            read_symmetry(self.symmetry)  # refuses what is none

    @property
    def center(self) -> np.ndarray:
        """Centre of the bounding box (of the grid, where there is no mesh) [m], shape (3,)."""
        if self.mesh is None:
            return np.asarray((self.sdf.lower + self.sdf.upper) / 2)
        return np.asarray(np.mean(self.mesh.bounds, axis=0))

    def __repr__(self) -> str:
        mm = (self.sdf.upper - self.sdf.lower if self.mesh is None else self.mesh.extents) * 1e3
        return f"ObjectModel({self.name!r}, {mm[0]:.0f} x {mm[1]:.0f} x {mm[2]:.0f} mm)"


def mesh_of(obj: ObjectModel) -> trimesh.Trimesh:
    """The object's surface in its own frame [m].

    Raises:
        MeshError: It is known by its field alone.
    """
    if obj.mesh is None:
        raise MeshError(
            f"object {obj.name!r} has a field alone, and this needs its mesh: give the mesh's file"
        )
    return obj.mesh


def load_object(
    name_or_path: str | Path,
    scale: float = 1.0,
    origin: Sequence[float] | Literal["center"] | None = None,
    resolution: int = 128,
    symmetry: Symmetry | str | Path | None = None,
) -> ObjectModel:
    """A built-in object by its name, or one from a mesh file or from a field's ``.npz``.

    The object frame o has the axes of the file and p_o = scale * p_file - origin. The distance field
    is built on first use (a second or two) and kept in the cache.

    Args:
        name_or_path: A name of ``vtgtsam.shapes.NAMES``, or the path of a mesh (OBJ, PLY, STL, ...), or of
            what ``GridSdf.save`` wrote: an object without a mesh, for which there are no metrics.
        scale: Metres per unit of the file; 0.001 for a mesh in millimetres.
        origin: Origin of the object frame [m], shape (3,); "center" for the middle of the bounding
            box; None keeps the file's.
        resolution: Nodes along each side of the distance field.
        symmetry: In the file's frame: an entry of BOP's ``models_info.json``, or the path of a JSON file
            with one, or "x", "y" or "z" for any turn about that axis through the middle of the bounding
            box, or "none". Where it is not given, it is read from a ``models_info.json`` beside the mesh.

    Raises:
        MeshError: There is no such object or file, or no distance field can be built from it, or the
            symmetry is none.
    """
    from .shapes import CATALOGUE

    if not isinstance(name_or_path, str | Path):
        raise ValueError(
            f"an object is given by its name or the path of its mesh, got {type(name_or_path).__name__}; "
            "of a field in memory make ObjectModel(name, sdf)"
        )
    if isinstance(scale, bool) or not isinstance(scale, int | float | np.number):
        raise ValueError(f"scale must be a positive number of metres per unit, got {scale!r}")
    if not (np.isfinite(scale) and scale > 0):
        raise ValueError(f"scale must be a positive number of metres per unit, got {scale!r}")
    shape = CATALOGUE.get(str(name_or_path))
    if shape is None:
        path = _existing(name_or_path, CATALOGUE)
        if path.suffix.lower() == ".npz":
            return _from_field(path, float(scale), origin, symmetry)
        mesh, name, source = read_mesh(path), path.stem, str(path)
    else:
        mesh, name, source = shape.mesh(), shape.name, shape.name
    sha256 = sha256_of(mesh.vertices, mesh.faces)
    mesh.apply_scale(scale)
    mesh.metadata["name"] = name  # what a refusal calls it
    shift = _origin(origin, np.asarray(mesh.bounds))
    grid = build_sdf(mesh, resolution)  # before the shift, so that all origins share one field
    if symmetry is not None:
        found = read_symmetry(symmetry, np.asarray(mesh.bounds.mean(axis=0)))
    else:
        found = shape.symmetry_about(np.zeros(3)) if shape else symmetry_beside(path)
    mesh.apply_translation(-shift)
    return ObjectModel(
        name=name,
        sdf=GridSdf(grid.values, grid.lower - shift, grid.upper - shift),
        mesh=mesh,
        symmetry=None if found is None else shifted(found, -shift),
        mass=shape.mass * scale**3 if shape else None,
        source=source,
        sha256=sha256,
        scale=float(scale),
        origin=(float(shift[0]), float(shift[1]), float(shift[2])),
    )


def _from_field(
    path: Path,
    scale: float,
    origin: Sequence[float] | str | None,
    symmetry: Symmetry | str | Path | None,
) -> ObjectModel:
    """An object that is a field alone, in the field's frame."""
    field_o = GridSdf.load(path)
    if scale != 1.0:
        raise ValueError(
            f"{path} is a distance field, which is in metres: scale must be 1, got {scale:g}"
        )
    bounds = np.array([field_o.lower, field_o.upper])
    shift = _origin(origin, bounds)
    found = None if symmetry is None else read_symmetry(symmetry, bounds.mean(axis=0))
    return ObjectModel(
        name=path.stem,
        sdf=GridSdf(field_o.values, field_o.lower - shift, field_o.upper - shift),
        symmetry=None if found is None else shifted(found, -shift),
        source=str(path),
        origin=(float(shift[0]), float(shift[1]), float(shift[2])),
    )


def _existing(name_or_path: str | Path, known: dict[str, Any]) -> Path:
    path = Path(name_or_path).expanduser()
    if not path.is_file():
        raise MeshError(
            f"{str(name_or_path)!r} is neither a mesh file nor a built-in object; "
            f"the built-in ones are: {', '.join(known)}"
        )
    return path


def _origin(origin: Sequence[float] | str | None, bounds: np.ndarray) -> np.ndarray:
    if origin is None:
        return np.zeros(3)
    if isinstance(origin, str):
        if origin != "center":
            raise ValueError(f'origin must be three numbers [m], "center" or None, got {origin!r}')
        return np.asarray(bounds.mean(axis=0))
    shift = np.asarray(origin, dtype=np.float64)
    if shift.shape != (3,) or not np.isfinite(shift).all():
        raise ValueError(f'origin must be three numbers [m], "center" or None, got {origin!r}')
    return shift
