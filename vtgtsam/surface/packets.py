# SPDX-License-Identifier: MIT
r"""The nearest triangles to packets: points that lie together and share one search.

Let c be the middle of a packet and r its radius. A triangle at a distance D' from c can be left out where

    D' > U + r,

U being the largest of the points' distances to the triangles tried so far. Where c is further from the surface
than r, that keeps a wide round patch of it, and the direction says more. Let q be a surface point at a distance
D = |c - q| in the direction s = (c - q) / D. For a point x = c + d

    distance(x) <= |x - q| = sqrt(D^2 + 2 D s.d + |d|^2) <= D + s.d + |d|^2 / (2 D).

A triangle, or a box around several, whose nearest point to c lies at a distance D' in the direction s' is convex,
and so is the distance to it, which therefore lies above its tangent at c:

    distance'(x) >= D' + s'.d.

So it may be left out where D' - D exceeds the largest (s - s').d + |d|^2 / (2 D) in the packet, that is
|s - s'|.h + r^2 / (2 D), h being half the sides of the packet's box.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled, inlined, inlined_fast
from .boxes import box_gaps, box_offset, children_wait
from .tree import WIDTH, Tree
from .triangles import Packet, offset, to_triangle, triangle_gaps

SLACK = 1e-9  # relative: rounding must not leave out the nearest itself


@compiled
def nearest_to_packet(
    tree: Tree,
    packet: Packet,
    count: int,
    slot: int,
    stack: NDArray[np.int64],
    bounds: NDArray[np.float64],
    gaps: NDArray[np.float64],
) -> int:
    """Squared distances of finite points that lie together, and the slot nearest to their middle.

    Args:
        tree: A ``Tree``.
        packet: The points, with room for a multiple of eight; their squared distances are written.
        count: Number of points.
        slot: The triangle to try first: its leaf times 8 plus its place there.
        stack: Scratch for nodes that wait, int64 (STACK,).
        bounds: Scratch for their squared distances (STACK,).
        gaps: Scratch (8,).
    """
    count = _filled_up(packet, count)
    x, y, z, hx, hy, hz = _box(packet, count)
    half, radius = (hx, hy, hz), _radius(packet, count, x, y, z)
    packet.squared[:count] = np.inf
    first, triangles, place = slot, tree.triangles[slot // WIDTH], slot % WIDTH
    to_triangle(triangles, place, packet, count)
    limit = _limit(packet, count, radius)
    least, direction = _length(offset(triangles, place, x, y, z))
    stack[0], bounds[0], waiting = 0, 0.0, 1
    while waiting > 0:
        waiting -= 1
        if not bounds[waiting] < limit:
            continue
        node, is_far = stack[waiting], least > radius
        if node < len(tree.boxes):
            boxes = tree.boxes[node]
            box_gaps(boxes, x, y, z, gaps)
            if is_far:
                for place in range(WIDTH):
                    if gaps[place] < limit and _needless(
                        box_offset(boxes, place, x, y, z), least, direction, half, radius
                    ):
                        gaps[place] = np.inf
            waiting = children_wait(tree, node, gaps, limit, stack, bounds, waiting)
            continue
        leaf = node - len(tree.boxes)
        triangles = tree.triangles[leaf]
        triangle_gaps(triangles, x, y, z, gaps)
        for place in range(WIDTH):
            if not gaps[place] < limit or leaf * WIDTH + place == first:
                continue
            if is_far and _needless(
                offset(triangles, place, x, y, z), least, direction, half, radius
            ):
                continue
            to_triangle(triangles, place, packet, count)
            if gaps[place] < least * least:
                slot = leaf * WIDTH + place
                least, direction = _length(offset(triangles, place, x, y, z))
        limit = _limit(packet, count, radius)
    return slot


@inlined
def _needless(
    to_other: tuple[float, float, float],
    least: float,
    direction: tuple[float, float, float],
    half: tuple[float, float, float],
    radius: float,
) -> bool:
    """The second bound above: ``to_other`` is D' s', ``least`` is D > 0, ``direction`` s, ``half`` h."""
    distance, (sx, sy, sz) = _length(to_other)
    turn = half[0] * abs(sx - direction[0])
    turn += half[1] * abs(sy - direction[1]) + half[2] * abs(sz - direction[2])
    return bool(distance - least - SLACK * least > turn + radius * radius / (2 * least))


@inlined
def _length(vector: tuple[float, float, float]) -> tuple[float, tuple[float, float, float]]:
    """Length and direction of a vector; one without length has the direction 0."""
    x, y, z = vector
    length = np.sqrt(x * x + y * y + z * z)
    inverse = 1.0 / length if length > 0.0 else 0.0
    return length, (x * inverse, y * inverse, z * inverse)


@compiled
def _filled_up(packet: Packet, count: int) -> int:
    """Repeat the last point until there is a multiple of eight: a vectorised loop's rest is slow."""
    filled = -(-count // WIDTH) * WIDTH
    for n in range(count, filled):
        packet.x[n], packet.y[n], packet.z[n] = (
            packet.x[count - 1],
            packet.y[count - 1],
            packet.z[count - 1],
        )
    return filled


@inlined_fast
def _limit(packet: Packet, count: int, radius: float) -> float:
    """(U + r)^2 of the first bound above."""
    largest = 0.0
    for n in range(count):
        largest = max(largest, packet.squared[n])
    reach: float = (np.sqrt(largest) + radius) * (1 + SLACK)
    return reach * reach


@inlined_fast
def _box(packet: Packet, count: int) -> tuple[float, float, float, float, float, float]:
    """Middle of the points' box and half its sides."""
    lx = ux = packet.x[0]
    ly = uy = packet.y[0]
    lz = uz = packet.z[0]
    for n in range(count):
        lx, ux = min(lx, packet.x[n]), max(ux, packet.x[n])
        ly, uy = min(ly, packet.y[n]), max(uy, packet.y[n])
        lz, uz = min(lz, packet.z[n]), max(uz, packet.z[n])
    return (lx + ux) / 2, (ly + uy) / 2, (lz + uz) / 2, (ux - lx) / 2, (uy - ly) / 2, (uz - lz) / 2


@inlined_fast
def _radius(packet: Packet, count: int, x: float, y: float, z: float) -> float:
    """Largest distance of a point to (x, y, z)."""
    largest = 0.0
    for n in range(count):
        dx, dy, dz = packet.x[n] - x, packet.y[n] - y, packet.z[n] - z
        largest = max(largest, dx * dx + dy * dy + dz * dz)
    radius: float = np.sqrt(largest)
    return radius
