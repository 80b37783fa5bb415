# SPDX-License-Identifier: MIT
"""A hand's shape as triangles, one mesh a link, from its MuJoCo model."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from .pad_boxes import rotation_of

if TYPE_CHECKING:
    import trimesh

SHOWN_GROUPS = 3  # MuJoCo's own viewer shows groups 0 to 2; by habit 3 holds what only collides


@dataclass(frozen=True, eq=False)
class LinkMesh:
    """The shape of one link in its own frame b.

    Attributes:
        vertices: [m], shape (N, 3).
        faces: Indices of vertices, shape (F, 3).
        colors: RGBA of each vertex, uint8, shape (N, 4).
    """

    vertices: np.ndarray
    faces: np.ndarray
    colors: np.ndarray


def link_meshes(model: mujoco.MjModel) -> dict[int, LinkMesh]:
    """The shapes of a hand's links by body id, links without any left out.

    Geoms of groups 0 to 2 are taken; where there are none (a hand that lacks its mesh files), all.
    """
    links: dict[int, list[LinkMesh]] = {}
    for i in shown_geoms(model):
        shape = _geom_mesh(model, i)
        if shape is not None:
            links.setdefault(int(model.geom_bodyid[i]), []).append(shape)
    return {body: _joined(parts) for body, parts in links.items()}


def shown_geoms(model: mujoco.MjModel) -> list[int]:
    """Ids of the geoms that are what a hand looks like: groups 0 to 2, or all where there are none."""
    shown = [i for i in range(model.ngeom) if model.geom_group[i] < SHOWN_GROUPS]
    return shown or list(range(model.ngeom))


def _joined(parts: list[LinkMesh]) -> LinkMesh:
    starts = np.cumsum([0, *(len(part.vertices) for part in parts)])
    return LinkMesh(
        np.concatenate([part.vertices for part in parts]),
        np.concatenate([part.faces + start for part, start in zip(parts, starts, strict=False)]),
        np.concatenate([part.colors for part in parts]),
    )


def _geom_mesh(model: mujoco.MjModel, geom: int) -> LinkMesh | None:
    found = geom_triangles(model, geom)
    if found is None:
        return None
    vertices, faces = found
    vertices_b = vertices @ rotation_of(model.geom_quat[geom]).T + model.geom_pos[geom]
    material = model.geom_matid[geom]
    rgba = model.geom_rgba[geom] if material < 0 else model.mat_rgba[material]
    color = np.rint(255 * np.clip(rgba, 0, 1)).astype(np.uint8)
    return LinkMesh(vertices_b, faces, np.tile(color, (len(vertices), 1)))


def geom_triangles(model: mujoco.MjModel, geom: int) -> tuple[np.ndarray, np.ndarray] | None:
    """Vertices and faces in the geom's frame; None for planes and other things without a volume."""
    kind = mujoco.mjtGeom(model.geom_type[geom])
    if kind == mujoco.mjtGeom.mjGEOM_MESH:
        return _mesh_asset(model, model.geom_dataid[geom])
    if kind not in _PRIMITIVES:
        return None
    mesh = _PRIMITIVES[kind](model.geom_size[geom])
    return np.asarray(mesh.vertices), np.asarray(mesh.faces)


def _mesh_asset(model: mujoco.MjModel, mesh: int) -> tuple[np.ndarray, np.ndarray]:
    vertex, face = model.mesh_vertadr[mesh], model.mesh_faceadr[mesh]
    return (
        model.mesh_vert[vertex : vertex + model.mesh_vertnum[mesh]],
        model.mesh_face[face : face + model.mesh_facenum[mesh]],
    )


def _box(size: np.ndarray) -> trimesh.Trimesh:
    import trimesh

    return _with_edges(trimesh.creation.box(extents=2 * size))


def _cylinder(size: np.ndarray) -> trimesh.Trimesh:
    import trimesh

    return _with_edges(trimesh.creation.cylinder(radius=size[0], height=2 * size[1], sections=32))


def _capsule(size: np.ndarray) -> trimesh.Trimesh:
    import trimesh

    mesh = trimesh.creation.capsule(height=2 * size[1], radius=size[0], count=[16, 16])
    mesh.apply_translation(-mesh.bounds.mean(axis=0))  # its origin depends on trimesh's version
    return mesh


def _ellipsoid(size: np.ndarray) -> trimesh.Trimesh:
    import trimesh

    mesh = trimesh.creation.icosphere(subdivisions=2, radius=1.0)
    mesh.apply_scale(size)
    return mesh


def _with_edges(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """Each face with corners of its own, so that a viewer shades edges as edges."""
    mesh.unmerge_vertices()
    return mesh


def _sphere(size: np.ndarray) -> trimesh.Trimesh:
    return _ellipsoid(np.full(3, size[0]))


_PRIMITIVES: dict[mujoco.mjtGeom, Callable[[np.ndarray], trimesh.Trimesh]] = {
    mujoco.mjtGeom.mjGEOM_BOX: _box,
    mujoco.mjtGeom.mjGEOM_CYLINDER: _cylinder,
    mujoco.mjtGeom.mjGEOM_CAPSULE: _capsule,
    mujoco.mjtGeom.mjGEOM_ELLIPSOID: _ellipsoid,
    mujoco.mjtGeom.mjGEOM_SPHERE: _sphere,
}
