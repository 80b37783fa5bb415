# SPDX-License-Identifier: MIT
"""The mesh and texture files that a hand's description names: found, or left out one by one.

Kinematics and pads need none of them; they are what cameras, pictures and the simulator see.
"""

from __future__ import annotations

import re
from pathlib import Path

import mujoco
import numpy as np

from ..mesh.reading import read_mesh

READABLE = (".stl", ".obj", ".msh")  # by MuJoCo
_FROM_FILES = (
    mujoco.mjtGeom.mjGEOM_MESH,
    mujoco.mjtGeom.mjGEOM_HFIELD,
    mujoco.mjtGeom.mjGEOM_SDF,
)
_SCHEMES = ("package://", "model://")


def needed(spec: mujoco.MjSpec) -> bool:
    """Whether a description lies partly in other files."""
    return bool(spec.meshes or spec.textures or spec.hfields or spec.skins)


def settle(spec: mujoco.MjSpec) -> str:
    """Find the files, and remove what is missing or of a kind that MuJoCo does not read.

    Returns:
        What was left out and why, in words; empty where nothing was.
    """
    missing, unread = [], []
    for mesh in list(spec.meshes):
        if not mesh.file:
            continue  # its vertices stand in the description
        found = _found(spec, mesh.file)
        if found is None:
            missing.append(mesh.file)
            _remove_mesh(spec, mesh)
        elif found.suffix.lower() == ".ply":
            _embed(mesh, found)
        elif found.suffix.lower() not in READABLE:
            unread.append(mesh.file)
            _remove_mesh(spec, mesh)
        elif "://" in mesh.file:
            mesh.file = str(found)
    _blank_textures(spec, only_missing=True)
    reasons = []
    if missing:
        reasons.append(f"{_some(missing)}, not found")
    if unread:
        reasons.append(f"{_some(unread)}: read are STL, OBJ and PLY")
    return "; ".join(reasons)


def _embed(mesh: mujoco.MjsMesh, path: Path) -> None:
    """Put a file that MuJoCo does not read into the description."""
    surface = read_mesh(path)
    mesh.name, mesh.file = mesh.name or path.stem, ""
    mesh.uservert = np.asarray(surface.vertices, dtype=np.float64).ravel()
    mesh.userface = np.asarray(surface.faces, dtype=np.int32).ravel()


def _some(names: list[str]) -> str:
    more = f" and {len(names) - 2} more" if len(names) > 2 else ""
    return f"mesh {', '.join(names[:2])}{more}"


def _found(spec: mujoco.MjSpec, file: str, folder: str | None = None) -> Path | None:
    base = Path(spec.modelfiledir or ".")
    if file.startswith("file://"):
        file = file.removeprefix("file://")
    for scheme in _SCHEMES:
        if file.startswith(scheme):
            return _in_package(base.resolve(), file.removeprefix(scheme))
    path = base / (spec.compiler.meshdir if folder is None else folder) / file
    return path if path.is_file() else None


def _in_package(base: Path, file: str) -> Path | None:
    """``NAME/rest`` where NAME is the hand's own folder, one above it, or beside one of those."""
    name, _, rest = file.partition("/")
    for folder in (base, *base.parents):
        for candidate in (folder / rest if folder.name == name else folder, folder / file):
            if candidate.is_file():
                return candidate
    return None


def _remove_mesh(spec: mujoco.MjSpec, mesh: mujoco.MjsMesh) -> None:
    for geom in _users(spec, mesh):
        spec.delete(geom)
    spec.delete(mesh)


def _users(spec: mujoco.MjSpec, mesh: mujoco.MjsMesh) -> list[mujoco.MjsGeom]:
    name = mesh.name or Path(mesh.file).stem
    return [geom for geom in spec.geoms if geom.meshname == name]


def spare(spec: mujoco.MjSpec, error: Exception) -> str | None:
    """Ask less of the mesh that the compiler stopped at: no mass and no contact, then not even to be seen.

    Returns:
        None where the error was not about a mesh; the mesh's name where it was left out, else "".
    """
    said = re.search(r"mesh.*Element name '([^']*)'", " ".join(str(error).split()))
    name = said[1] if said else None
    for (
        geom
    ) in spec.geoms:  # a compiler that stopped leaves this as the mesh has it, and then objects
        if geom.type == mujoco.mjtGeom.mjGEOM_MESH:
            geom.typeinertia = mujoco.mjtGeomInertia.mjINERTIA_VOLUME
    for mesh in list(spec.meshes):
        if mesh.name != name:
            continue
        if mesh.inertia == mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL:
            _remove_mesh(spec, mesh)
            return str(name)
        mesh.inertia = mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL
        for geom in _users(spec, mesh):
            geom.mass = geom.contype = geom.conaffinity = 0
        return ""
    return None


def remove_all(spec: mujoco.MjSpec) -> None:
    """Remove what lies in other files (meshes, textures); joints and boxes stay."""
    for geom in list(spec.geoms):
        if geom.type in _FROM_FILES:
            spec.delete(geom)
    for asset in [*spec.meshes, *spec.hfields, *spec.skins]:
        spec.delete(asset)
    _blank_textures(spec, only_missing=False)


def _blank_textures(spec: mujoco.MjSpec, only_missing: bool) -> None:
    """Materials may refer to a texture, so it stays, in one colour."""
    for texture in spec.textures:
        if only_missing and (
            not texture.file or _found(spec, texture.file, spec.compiler.texturedir)
        ):
            continue
        texture.file = ""
        texture.builtin = mujoco.mjtBuiltin.mjBUILTIN_FLAT
        texture.width = texture.height = 8
