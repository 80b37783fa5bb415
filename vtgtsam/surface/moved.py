# SPDX-License-Identifier: MIT
"""Mean distances of points that move together, for many of their poses.

The points in all poses are sorted into small cells, each with one search for its points: whichever point comes
by there in whichever pose needs the same few triangles.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..compiled import compiled, inlined_fast
from .boxes import STACK
from .packets import nearest_to_packet
from .tree import Tree
from .triangles import Packet

PACKET = 64  # points
POSES = 2**11  # poses whose points are sorted together, at most
TOGETHER = 2_000_000  # points that are sorted together, if one pose has no more: 24 MB
CELLS = 64  # along each side, at most


def alike(transforms: np.ndarray, points: np.ndarray) -> list[np.ndarray]:
    """Indices of transforms (N, 3, 4) in groups that take the points (P, 3) to like places.

    Groups are halved along what differs most, the place of the points' middle or a turn times their reach,
    until they have no more than POSES poses and TOGETHER points.
    """
    middle = points.mean(axis=0)
    reach = np.sqrt(((points - middle) ** 2).sum(axis=1).mean())
    places = transforms[:, :, :3] @ middle + transforms[:, :, 3]
    features = np.hstack([places, reach * transforms[:, :, :3].reshape(-1, 9)])
    size = min(max(TOGETHER // len(points), 1), POSES)
    waiting, groups = [np.arange(len(transforms))], []
    while waiting:
        group = waiting.pop()
        if len(group) <= size:
            groups.append(group)
            continue
        along = features[group, np.ptp(features[group], axis=0).argmax()]
        group = group[along.argsort(kind="stable")]
        cut = -(-len(group) // size) // 2 * size  # so that all groups but one are full
        waiting += [group[cut:], group[:cut]]
    return groups


def cells(transforms: np.ndarray, points: np.ndarray) -> tuple[np.ndarray, float, int]:
    """Lower corner (3,) [m] and cells per metre of a cube around all moved points, and cells a side."""
    box = np.array(np.meshgrid(*zip(points.min(axis=0), points.max(axis=0), strict=True)))
    corners = transforms[:, :, :3] @ box.reshape(3, 8) + transforms[:, :, 3:]
    lower = corners.min(axis=(0, 2))
    side = max(float((corners.max(axis=(0, 2)) - lower).max()), 1e-12)
    # A surface passes through about 4 n^2 of n^3 cells; 16 points or more in each share a search.
    count = int(np.sqrt(len(points) * len(transforms) / (4 * 16)))
    count = min(max(count, 1), CELLS)
    return lower, count / side, count


@compiled
def sum_distances(
    tree: Tree,
    points: NDArray[np.float64],
    rows: NDArray[np.float64],
    lower: NDArray[np.float64],
    scale: float,
    side: int,
    packet: Packet,
    gaps: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Each transform's sum of the distances of all points [m], shape (N,).

    Args:
        tree: A ``Tree``.
        points: Points (P, 3) [m].
        rows: Entries of the transforms, row by row, all finite, shape (12, N), N up to POSES.
        lower: Lower corner of the cells [m], shape (3,).
        scale: Cells per metre.
        side: Cells along each side.
        packet: Scratch of PACKET points.
        gaps: Scratch (8,).
    """
    which, ends = _by_cell(points, rows, lower, scale, side)
    sums = np.zeros(rows.shape[1])
    stack, bounds, slot = np.empty(STACK, np.int64), np.empty(STACK), 0
    begin = 0
    for end in ends:
        while begin < end:
            count = min(end - begin, PACKET)
            for n in range(count):
                point, pose = which[begin + n] // POSES, which[begin + n] % POSES
                packet.x[n], packet.y[n], packet.z[n] = _moved(
                    rows, pose, points[point, 0], points[point, 1], points[point, 2]
                )
            slot = nearest_to_packet(tree, packet, count, slot, stack, bounds, gaps)
            for n in range(count):
                sums[which[begin + n] % POSES] += np.sqrt(packet.squared[n])
            begin += count
    return sums


@compiled
def _by_cell(
    points: NDArray[np.float64],
    rows: NDArray[np.float64],
    lower: NDArray[np.float64],
    scale: float,
    side: int,
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Numbers POSES * point + pose in the order of their cells, and where each cell's end."""
    cell = np.empty((len(points), rows.shape[1]), np.int32)
    ends = np.zeros(side**3, np.int64)
    for point in range(len(points)):
        _find_cells(points, rows, point, lower, scale, side, cell[point])
        for pose in range(rows.shape[1]):
            ends[cell[point, pose]] += 1
    begin = 0
    for n in range(len(ends)):
        begin, ends[n] = begin + ends[n], begin
    which = np.empty(cell.size, np.int64)
    for point in range(len(points)):
        for pose in range(rows.shape[1]):
            n = cell[point, pose]
            which[ends[n]] = point * POSES + pose
            ends[n] += 1
    return which, ends


@inlined_fast
def _find_cells(
    points: NDArray[np.float64],
    rows: NDArray[np.float64],
    point: int,
    lower: NDArray[np.float64],
    scale: float,
    side: int,
    cell: NDArray[np.int32],
) -> None:
    """The cell of one point in each pose, written to ``cell`` (N,)."""
    x, y, z = points[point, 0], points[point, 1], points[point, 2]
    lx, ly, lz, last = lower[0], lower[1], lower[2], side - 1.0
    for pose in range(len(cell)):
        mx, my, mz = _moved(rows, pose, x, y, z)
        i = np.int32(min(max((mx - lx) * scale, 0.0), last))
        j = np.int32(min(max((my - ly) * scale, 0.0), last))
        k = np.int32(min(max((mz - lz) * scale, 0.0), last))
        cell[pose] = (i * side + j) * side + k


@inlined_fast
def _moved(
    rows: NDArray[np.float64], pose: int, x: float, y: float, z: float
) -> tuple[float, float, float]:
    """One point in one pose."""
    return (
        rows[0, pose] * x + rows[1, pose] * y + rows[2, pose] * z + rows[3, pose],
        rows[4, pose] * x + rows[5, pose] * y + rows[6, pose] * z + rows[7, pose],
        rows[8, pose] * x + rows[9, pose] * y + rows[10, pose] * z + rows[11, pose],
    )
