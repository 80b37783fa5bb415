# SPDX-License-Identifier: MIT
"""Closed surfaces made by code: lofts, tubes, boxes and warped spheres [m].

All of them are watertight with outward faces. Vertices lie about evenly, since the mean of ADD-S is
taken over vertices.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import trimesh


def loft(rings: np.ndarray) -> trimesh.Trimesh:
    """Skin over closed rings, shape (m, n, 3); the first and last are closed by a fan."""
    m, n, _ = rings.shape
    vertices = np.concatenate(
        [rings.reshape(-1, 3), [rings[0].mean(axis=0), rings[-1].mean(axis=0)]]
    )
    i, j = np.arange(n), np.roll(np.arange(n), -1)
    below = n * np.arange(m - 1)[:, None]
    a, b, c, d = below + i, below + j, below + n + j, below + n + i
    last = n * (m - 1)
    faces = np.concatenate(
        [
            np.stack([a, b, c], axis=-1).reshape(-1, 3),
            np.stack([a, c, d], axis=-1).reshape(-1, 3),
            np.stack([j, i, np.full(n, m * n)], axis=-1),
            np.stack([last + i, last + j, np.full(n, m * n + 1)], axis=-1),
        ]
    )
    return _outward(trimesh.Trimesh(vertices, faces))


def sections(
    outline: Callable[[float, float], np.ndarray],
    profile: Sequence[tuple[float, float]],
    step: float,
) -> trimesh.Trimesh:
    """Loft along z of one family of outlines.

    Args:
        outline: Maps (inset [m], height [m]) to a ring (n, 3); inset 0 is the full section.
        profile: Corners (inset, z) from the bottom's middle to the top's; the rings between them
            are at most ``step`` apart.
        step: Longest distance between rings [m].
    """
    rings = [outline(*profile[0])]
    for start, end in zip(np.array(profile[:-1]), np.array(profile[1:]), strict=True):
        count = max(1, int(np.ceil(np.linalg.norm(end - start) / step)))
        rings += [outline(*(start + (end - start) * k / count)) for k in range(1, count + 1)]
    return loft(np.array(rings))


def revolve(
    profile: Sequence[tuple[float, float]], step: float, around: int = 64
) -> trimesh.Trimesh:
    """Surface of revolution about z.

    Args:
        profile: Corners (radius, z) from axis to axis [m]; the ends are set a little off the axis.
        step: Longest distance between rings [m]; on flat ends rings are spaced evenly in area.
        around: Number of vertices around the axis.
    """
    angles = 2 * np.pi * np.arange(around) / around
    rings = []
    for (r0, z0), (r1, z1) in zip(profile[:-1], profile[1:], strict=True):
        flat = abs(z1 - z0) < 1e-9
        length = (
            abs(r1**2 - r0**2) * np.pi / (around * step) if flat else np.hypot(r1 - r0, z1 - z0)
        )
        t = np.linspace(0, 1, max(1, int(np.ceil(length / step))), endpoint=False)
        radii = np.sqrt(r0**2 + (r1**2 - r0**2) * t) if flat else r0 + (r1 - r0) * t
        rings += list(zip(radii, z0 + (z1 - z0) * t, strict=True))
    # A ring on the axis is the fan's centre, which `loft` adds itself.
    kept = np.array([ring for ring in [*rings, profile[-1]] if ring[0] > 1e-6])
    radius, z = kept[:, :1], np.broadcast_to(kept[:, 1:], (len(kept), around))
    return loft(np.stack([radius * np.cos(angles), radius * np.sin(angles), z], axis=-1))


def tube(
    path: np.ndarray, radii: np.ndarray | float, around: int = 24, section: np.ndarray | float = 1.0
) -> trimesh.Trimesh:
    """Tube along a planar path (m, 3) in the plane y = 0; ``section`` (n,) scales its radius by angle."""
    tangents = np.gradient(path, axis=0)
    tangents /= np.linalg.norm(tangents, axis=1, keepdims=True)
    out = np.array([0.0, 1.0, 0.0])
    across = np.cross(tangents, out)
    angles = 2 * np.pi * np.arange(around) / around
    radius = np.broadcast_to(radii, len(path))[:, None, None] * np.reshape(section, (1, -1, 1))
    circle = (
        np.cos(angles)[None, :, None] * across[:, None, :] + np.sin(angles)[None, :, None] * out
    )
    return loft(path[:, None, :] + radius * circle)


def ball(warp: Callable[[np.ndarray], np.ndarray], subdivisions: int = 4) -> trimesh.Trimesh:
    """A unit sphere of even vertices, each moved by ``warp``: (n, 3) unit vectors to positions [m]."""
    sphere = trimesh.creation.icosphere(subdivisions=subdivisions)
    return _outward(trimesh.Trimesh(warp(np.asarray(sphere.vertices)), sphere.faces))


def rounded_box(
    size: Sequence[float], radius: float, count: int = 24, rounds: int = 3
) -> trimesh.Trimesh:
    """Box with all edges rounded by ``radius``, about ``count`` cells on its longest side."""
    core = np.asarray(size) / 2 - radius
    step = 2 * core.max() / count
    axes = [_ticks(half, radius, max(2, round(2 * half / step)), rounds) for half in core]
    vertices, faces = _grid_box([len(axis) for axis in axes])
    grid = np.stack([axes[d][vertices[:, d]] for d in range(3)], axis=-1)
    inner = np.clip(grid, -core, core)
    outward = grid - inner
    # On an edge two axes are beyond the core and on a corner three; the grid is spread over the
    # quarter circle by tan, so that equal angles come out.
    norm = np.linalg.norm(outward, axis=1, keepdims=True)
    return _outward(trimesh.Trimesh(inner + radius * outward / norm, faces))


def _ticks(half: float, radius: float, cells: int, rounds: int) -> np.ndarray:
    bend = radius * np.tan(np.linspace(0, np.pi / 4, rounds + 1))[1:]
    return np.concatenate([-half - bend[::-1], np.linspace(-half, half, cells + 1), half + bend])


def _grid_box(counts: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Surface of a block of grid nodes: their indices (n, 3) and triangles."""
    index = np.full(counts, -1)
    nodes = np.indices(counts).reshape(3, -1).T
    surface = nodes[((nodes == 0) | (nodes == np.array(counts) - 1)).any(axis=1)]
    index[tuple(surface.T)] = np.arange(len(surface))
    faces = []
    for axis in range(3):
        for end in (0, -1):
            face = np.take(index, end, axis=axis)
            face = face if (end == -1) == (axis != 1) else face.T  # so that all look outward
            a, b, c, d = face[:-1, :-1], face[1:, :-1], face[1:, 1:], face[:-1, 1:]
            for triangle in ((a, b, c), (a, c, d)):
                faces.append(np.stack(triangle, axis=-1).reshape(-1, 3))
    return surface, np.concatenate(faces)


def rounded_rectangle(length: float, width: float, radius: float, count: int) -> np.ndarray:
    """About ``count`` points around a rectangle with rounded corners, shape (n, 2), evenly spaced."""
    radius = min(radius, length / 2, width / 2)
    corners = np.array([[1, 1], [-1, 1], [-1, -1], [1, -1]]) * [
        length / 2 - radius,
        width / 2 - radius,
    ]
    quarter = np.linspace(0, np.pi / 2, 17)
    dense = [
        corner
        + radius
        * np.column_stack([np.cos(quarter + k * np.pi / 2), np.sin(quarter + k * np.pi / 2)])
        for k, corner in enumerate(corners)
    ]
    loop = np.concatenate([*dense, dense[0][:1]])
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(loop, axis=0), axis=1))])
    at = np.linspace(0, along[-1], count, endpoint=False)
    return np.column_stack([np.interp(at, along, loop[:, d]) for d in range(2)])


def union(*parts: trimesh.Trimesh) -> trimesh.Trimesh:
    """One closed surface around overlapping parts."""
    return _outward(trimesh.boolean.union(list(parts), engine="manifold"))


def _outward(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    if mesh.volume < 0:
        mesh.invert()
    return mesh
