# SPDX-License-Identifier: MIT
"""Which side of a mesh's faces is out: made to agree where a mesh leaves it open."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from ..exceptions import MeshError
from .reading import merged

if TYPE_CHECKING:
    import trimesh

SMALLEST_VOLUME = 1e-6  # of the cube of the longest extent: a sheet of paper has 2e-4


def outward(vertices: np.ndarray, faces: np.ndarray) -> tuple[trimesh.Trimesh, bool, list[str]]:
    """The mesh with merged vertices and faces that look out, and what was wrong with it.

    Returns:
        The mesh; whether it is closed: every edge joins two faces that agree about which side is out;
        one sentence for each problem.

    Raises:
        MeshError: The mesh has no volume.
    """
    mesh = merged(vertices, faces)
    problems = []
    if not mesh.is_watertight:
        problems.append(
            "the mesh is not watertight: its distance field is closed across the holes as the "
            "winding number sees them; close the holes in a mesh editor if it looks wrong"
        )
    if not mesh.is_winding_consistent:
        problems.append(
            "neighbouring faces of the mesh disagree about which side is out; they were turned to "
            "agree; recalculate the normals in a mesh editor if the result looks wrong"
        )
        mesh.faces = _agreeing(mesh)
    turned = _turn_outwards(mesh)
    if turned:
        problems.append(
            f"{turned} of the mesh's parts had faces that look inwards; they were turned; "
            "recalculate the normals in a mesh editor if the result looks wrong"
        )
    if _volume(mesh.triangles) < SMALLEST_VOLUME * mesh.extents.max() ** 3:
        raise MeshError("the mesh has no volume: it is flat; give it a thickness")
    return mesh, bool(mesh.is_watertight and mesh.is_winding_consistent), problems


def _agreeing(mesh: trimesh.Trimesh) -> np.ndarray:
    """The faces of a mesh, turned so that neighbours agree, in each part as most of its faces did."""
    import igl

    before = np.asarray(mesh.faces, dtype=np.int64)
    faces, part = igl.bfs_orient(before)
    kept = (faces == before).all(axis=1)
    turn = np.bincount(part, weights=kept) < np.bincount(part) / 2
    return np.asarray(np.where(turn[part][:, None], faces[:, ::-1], faces))


def _turn_outwards(mesh: trimesh.Trimesh) -> int:
    """Turn the parts of a mesh that look inwards and are no cavity in another; their number.

    A part with open edges is only turned with the whole: alone it has no inside.
    """
    import igl

    faces, (part, closed) = np.array(mesh.faces, dtype=np.int64), _parts(mesh)
    turned = np.zeros(len(closed), dtype=bool)
    if _volume(mesh.triangles) < 0:
        faces, turned = faces[:, ::-1], ~turned
    vertices = np.asarray(mesh.vertices)
    for n in np.flatnonzero(closed):
        own = part == n
        others = np.ascontiguousarray(faces[~own])
        if _volume(vertices[faces[own]]) >= 0:
            continue
        if (
            len(others) > 0
            and igl.winding_number(vertices, others, vertices[faces[own][0, :1]]) > 0.5
        ):
            continue  # a cavity
        faces[own] = faces[own, ::-1]
        turned[n] = not turned[n]
    if turned.any():
        mesh.faces = faces
    return int(turned.sum())


def _parts(mesh: trimesh.Trimesh) -> tuple[np.ndarray, np.ndarray]:
    """The connected part each face belongs to, and whether each part is closed."""
    import trimesh

    pairs, count = mesh.face_adjacency, len(mesh.faces)
    part = trimesh.graph.connected_component_labels(pairs, node_count=count)
    edge_of_face = mesh.edges_unique_inverse.reshape(-1, 3)
    joins_two = np.bincount(edge_of_face.ravel()) == 2
    is_open = np.bincount(part, weights=~joins_two[edge_of_face].all(axis=1)) > 0
    return part, ~is_open


def _volume(corners: np.ndarray) -> float:
    """Signed volume of triangles (F, 3, 3) [m^3], as if their centre closed the holes."""
    corners = np.asarray(corners) - np.mean(corners, axis=(0, 1))
    crossed = np.cross(corners[:, 1], corners[:, 2])
    return float((corners[:, 0] * crossed).sum() / 6)
