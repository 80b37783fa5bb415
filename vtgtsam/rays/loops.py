# SPDX-License-Identifier: MIT
"""The loops over geoms and rays: each geom is looked for only by the rays that pass its outline.

Rays from one point are sorted by the cell of an image that they pass, row by row: those of cell (v, u) are
``starts[v, u]`` to ``starts[v, u + 1]``. The image's ``grid`` is fx, fy, cx, cy and how far from its cell's middle
a ray may pass [cells]. What is nearest so far is in ``geom``, ``distance`` (-1: nothing) and
``normals_w``.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled, inlined
from ..compiled.stale import drop_stale
from .solids import MESH, meet_solid, solid_normal
from .vectors import Vector, cross, dot, into_frame, normal_into_world

drop_stale(Path(__file__).parent)  # solids and vectors are compiled into these loops

Whole = NDArray[np.int64]
SLACK = 1e-6  # [cells], of an outline
NEAR = 1e-6  # [m], what has a part this side of it has no outline


@inlined
def project(
    t: Vector, R: Vector, x: float, y: float, z: float, R_wc: Vector, grid: Vector, out: Vector
) -> None:
    """Fill ``out`` with cell (u, v) and depth [m] of (x, y, z) in a frame of pose R, t; t from the rays' origin."""
    for i in range(3):
        out[i] = 0.0
    for j in range(3):
        at_w = t[j] + R[j, 0] * x + R[j, 1] * y + R[j, 2] * z
        for i in range(3):
            out[i] += R_wc[j, i] * at_w
    if out[2] > NEAR:
        out[0] = grid[0] * out[0] / out[2] + grid[2]
        out[1] = grid[1] * out[1] / out[2] + grid[3]


@inlined
def open_outline(box: Vector) -> None:
    """Make an outline (u low, high, v low, high) an empty one."""
    box[0], box[1], box[2], box[3] = np.inf, -np.inf, np.inf, -np.inf


@inlined
def extend(box: Vector, at: Vector) -> None:
    """Let an outline reach a point (u, v, depth); everywhere if that is not in front."""
    if at[2] > NEAR:
        box[0], box[1] = min(box[0], at[0]), max(box[1], at[0])
        box[2], box[3] = min(box[2], at[1]), max(box[3], at[1])
    else:
        box[0], box[1], box[2], box[3] = -np.inf, np.inf, -np.inf, np.inf


@inlined
def cells(low: float, high: float, spread: float, count: int) -> tuple[int, int]:
    """The cells [first, end) of a row or column between two places."""
    first = np.ceil(min(max(low - spread - SLACK, 0.0), float(count)))
    end = np.floor(min(max(high + spread + SLACK, -1.0), float(count - 1))) + 1.0
    return int(first), int(end)


@inlined
def is_nearer(x: float, before: float) -> bool:
    """Whether something is met at distance x, and nearer than what was met before."""
    return x >= 0.0 and not 0.0 <= before <= x


@compiled
def cast_solid(
    number: int, kind: int, size: Vector, R_wg: Vector, p_g: Vector, box: Vector, grid: Vector,
    rays_w: Vector, starts: Whole,
    geom: NDArray[np.int32], distance: Vector, normals_w: Vector,
) -> None:  # fmt: skip
    """Let the rays from ``p_g`` in the solid's frame that pass the outline ``box`` meet solid ``number``."""
    r, q, n = np.empty(3), np.empty(3), np.empty(3)
    left, right = cells(box[0], box[1], grid[4], starts.shape[1] - 1)
    top, bottom = cells(box[2], box[3], grid[4], starts.shape[0])
    for row in range(top, bottom):
        for k in range(starts[row, left], starts[row, right]):
            into_frame(R_wg, rays_w[k], r)
            x = meet_solid(kind, size, p_g, r)
            if is_nearer(x, distance[k]):
                geom[k], distance[k] = number, x
                for i in range(3):
                    q[i] = p_g[i] + x * r[i]
                solid_normal(kind, size, q, n)
                normal_into_world(R_wg, n, normals_w[k])


@compiled
def cast_mesh(
    number: int, vertices: NDArray[np.float32], faces: NDArray[np.int32], R_wg: Vector, p_g: Vector,
    grid: Vector, R_wc: Vector, from_origin: Vector, rays_w: Vector, starts: Whole,
    geom: NDArray[np.int32], distance: Vector, normals_w: Vector,
) -> None:  # fmt: skip
    """Let rays from ``p_g`` in the mesh's frame meet mesh ``number``, of ``vertices`` (V, 3) and ``faces`` (F, 3).

    With a, b, c from ``p_g`` to a triangle's corners, ray r passes each edge on the side that r . (a x b),
    r . (b x c) and r . (c x a) say, and meets the triangle where none differs in sign from the others. The normal is
    n = a x b + b x c + c x a, the distance n . a / n . r. Neighbours share an edge's product, so no ray passes between.
    """
    at, box = np.empty((len(vertices), 3)), np.empty(4)
    for m in range(len(vertices)):
        v = vertices[m]
        project(from_origin, R_wg, v[0], v[1], v[2], R_wc, grid, at[m])
    r, n = np.empty(3), np.empty(3)
    corners, edges = np.empty((3, 3)), np.empty((3, 3))
    for f in range(len(faces)):
        open_outline(box)
        for i in range(3):
            extend(box, at[faces[f, i]])
        left, right = cells(box[0], box[1], grid[4], starts.shape[1] - 1)
        top, bottom = cells(box[2], box[3], grid[4], starts.shape[0])
        if left >= right or top >= bottom:
            continue
        for i in range(3):
            for j in range(3):
                corners[i, j] = vertices[faces[f, i], j] - p_g[j]
        for i in range(3):
            cross(corners[i], corners[(i + 1) % 3], edges[i])
        for j in range(3):
            n[j] = edges[0, j] + edges[1, j] + edges[2, j]
        volume = dot(n, corners[0])
        for row in range(top, bottom):
            for k in range(starts[row, left], starts[row, right]):
                into_frame(R_wg, rays_w[k], r)
                e0, e1, e2 = dot(r, edges[0]), dot(r, edges[1]), dot(r, edges[2])
                if min(e0, e1, e2) < 0.0 < max(e0, e1, e2) or e0 + e1 + e2 == 0.0:
                    continue  # beside the triangle, or along it
                x = volume / (e0 + e1 + e2)
                if is_nearer(x, distance[k]):
                    geom[k], distance[k] = number, x
                    normal_into_world(R_wg, n, normals_w[k])


@compiled
def cast(
    geoms: Whole, kinds: NDArray[np.int32], sizes: Vector, boxes: Vector, positions_w: Vector, rotations: Vector,
    meshes: Whole, vertices: NDArray[np.float32], faces: NDArray[np.int32],
    origin_w: Vector, R_wc: Vector, grid: Vector, rays_w: Vector, starts: Whole,
    geom: NDArray[np.int32], distance: Vector, normals_w: Vector,
) -> None:  # fmt: skip
    """Let rays meet all geoms of some numbers; arrays by geom are MuJoCo's.

    ``boxes`` (G, 6) are middle and half the sides of the boxes around geoms, ``meshes`` (G, 4) where the vertices
    and faces of a geom's mesh begin and end.
    """
    at, box, p_g = np.empty(3), np.empty(4), np.empty(3)
    geom[:] = -1
    distance[:] = -1.0
    normals_w[:] = 0.0
    for number in geoms:
        R_wg = rotations[number]
        from_origin = positions_w[number] - origin_w
        into_frame(R_wg, -from_origin, p_g)
        if kinds[number] == MESH:
            v0, v1, f0, f1 = meshes[number]
            cast_mesh(
                number, vertices[v0:v1], faces[f0:f1], R_wg, p_g, grid, R_wc, from_origin,
                rays_w, starts, geom, distance, normals_w,
            )  # fmt: skip
            continue
        open_outline(box)
        for corner in range(8):
            x = boxes[number, 0] + (boxes[number, 3] if corner & 1 else -boxes[number, 3])
            y = boxes[number, 1] + (boxes[number, 4] if corner & 2 else -boxes[number, 4])
            z = boxes[number, 2] + (boxes[number, 5] if corner & 4 else -boxes[number, 5])
            project(from_origin, R_wg, x, y, z, R_wc, grid, at)
            extend(box, at)
        cast_solid(
            number, kinds[number], sizes[number], R_wg, p_g, box, grid, rays_w, starts,
            geom, distance, normals_w,
        )  # fmt: skip
