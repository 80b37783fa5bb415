# SPDX-License-Identifier: MIT
"""Which side of a mesh's faces is out: made to agree where a mesh leaves it open.

A mesh that is closed and of one mind is left as it is. Else its faces fall into patches, which end at
edges that do not join exactly two faces. In each patch neighbours are made to agree; then straight rays
decide: they cross an even number of faces on the outer side and an odd one on the inner, whichever
way these look. A patch with the inside on both of its sides is a wall between two bodies, and goes.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from .rays import Rays
from .reading import merged
from .stitching import stitched
from .validation import check_volume

if TYPE_CHECKING:
    import trimesh

SEED = 0
SAMPLES = 20_000  # points from which rays are cast, all patches together
A_PATCH = 64, 2  # points on a patch, at most and at least
CLEAR = 0.3  # difference of the two sides' shares of outer rays that decides a patch
INNER = 0.2  # share of outer rays on both sides below which a patch is an inner wall
CAVITY = 15  # points of a closed part that are asked whether it is a cavity
OFF = 1e-5  # of the extent: where rays begin, off a face


def outward(vertices: np.ndarray, faces: np.ndarray) -> tuple[trimesh.Trimesh, bool, list[str]]:
    """The mesh with merged vertices and faces that look out, and what was wrong with it.

    Returns:
        The mesh; whether it is closed: every edge joins two faces that agree about which side is out;
        one sentence for each problem.

    Raises:
        MeshError: The mesh has no volume.
    """
    mesh, problems = merged(vertices, faces), []
    if not _is_closed(mesh):
        mesh, said = stitched(mesh)
        problems.extend(said)
    if not mesh.is_winding_consistent:
        problems.append(
            "neighbouring faces of the mesh disagree about which side is out; they were turned to "
            "agree; recalculate the normals in a mesh editor if the result looks wrong"
        )
        mesh.faces = _agreeing(mesh)
    turned = _turn_patches(mesh, problems) + _turn_closed(mesh)
    if turned:
        problems.append(
            f"{turned} of the mesh's parts had faces that look inwards; they were turned; "
            "recalculate the normals in a mesh editor if the result looks wrong"
        )
    check_volume(mesh, _volume(mesh.triangles))
    return mesh, _is_closed(mesh), problems


def _is_closed(mesh: trimesh.Trimesh) -> bool:
    return bool(mesh.is_watertight and mesh.is_winding_consistent)


def _agreeing(mesh: trimesh.Trimesh) -> np.ndarray:
    """The faces of a mesh, turned so that neighbours agree, in each part as most of its faces did."""
    import igl

    before = np.asarray(mesh.faces, dtype=np.int64)
    faces, part = igl.bfs_orient(before)
    kept = (faces == before).all(axis=1)
    turn = np.bincount(part, weights=kept) < np.bincount(part) / 2
    return np.asarray(np.where(turn[part][:, None], faces[:, ::-1], faces))


def _turn_patches(mesh: trimesh.Trimesh, problems: list[str]) -> int:
    """Turn the open patches whose inner side rays find in front, and take inner walls away; number turned."""
    part, closed = _parts(mesh)
    patches = np.flatnonzero(~closed)
    if len(patches) == 0:
        return 0
    front, back = _outer_shares(mesh, part, patches)
    turn = patches[back - front > CLEAR]
    doubtful = patches[np.abs(back - front) <= CLEAR]
    inner = patches[(front < INNER) & (back < INNER)]
    doubtful = doubtful[~np.isin(doubtful, inner)]
    unsure = np.isin(part, doubtful)
    if unsure.any() and _volume(mesh.triangles[unsure]) < 0:
        turn = np.concatenate([turn, doubtful])
    faces = np.array(mesh.faces)
    turned = np.isin(part, turn)
    faces[turned] = faces[turned, ::-1]
    inside = np.isin(part, inner)
    if inside.any() and not inside.all():
        faces = faces[~inside]
        problems.append(
            f"the mesh has {int(inside.sum())} faces with its inside on both sides; they were left out"
        )
    mesh.faces = faces
    return len(turn)


def _outer_shares(
    mesh: trimesh.Trimesh, part: np.ndarray, patches: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Share of rays that lead out, from in front of each patch and from behind it."""
    rng = np.random.default_rng(SEED)
    most, least = A_PATCH
    count = int(np.clip(SAMPLES // len(patches), least, most))
    order = np.argsort(part, kind="stable")
    bounds = np.searchsorted(part[order], [patches, patches + 1])
    areas, triangles, normals = mesh.area_faces, mesh.triangles, mesh.face_normals
    points, directions = [], []
    for start, end in bounds.T:
        own = order[start:end]
        weights = areas[own] if areas[own].sum() > 0 else np.ones(len(own))
        some = rng.choice(own, size=count, p=weights / weights.sum())
        weight = rng.dirichlet((1, 1, 1), size=count)
        points.append(np.einsum("nk,nkd->nd", weight, triangles[some]))
        directions.append(normals[some])
    on, out = np.concatenate(points), np.concatenate(directions)
    rays = Rays(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    off = OFF * float(mesh.extents.max())
    shares = [
        rays.outside(on + side * off * out, rng).reshape(len(patches), count).mean(axis=1)
        for side in (1.0, -1.0)
    ]
    return shares[0], shares[1]


def _turn_closed(mesh: trimesh.Trimesh) -> int:
    """Turn the closed parts of a mesh that look inwards and are no cavity in another; their number."""
    faces, (part, closed) = np.array(mesh.faces, dtype=np.int64), _parts(mesh)
    vertices, turned = np.asarray(mesh.vertices), np.zeros(len(closed), dtype=bool)
    bodies = closed[part]
    if bodies.any() and _volume(vertices[faces[bodies]]) < 0:  # cavities are turned with the rest
        faces[bodies], turned = faces[bodies, ::-1], closed.copy()
    for n in np.flatnonzero(closed):
        own = part == n
        if _volume(vertices[faces[own]]) >= 0 or _is_cavity(vertices, faces[own], faces[~own]):
            continue
        faces[own] = faces[own, ::-1]
        turned[n] = not turned[n]
    if turned.any():
        mesh.faces = faces
    return int(turned.sum())


def _is_cavity(vertices: np.ndarray, own: np.ndarray, others: np.ndarray) -> bool:
    """Whether a closed part lies inside others."""
    if len(others) == 0:
        return False
    rng = np.random.default_rng(SEED)
    some = rng.choice(len(own), size=min(CAVITY, len(own)), replace=False)
    centres = vertices[own[some]].mean(axis=1)
    return bool(Rays(vertices, others).outside(centres, rng, rays=5).mean() < 0.5)


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
