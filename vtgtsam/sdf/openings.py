# SPDX-License-Identifier: MIT
"""Holes of a mesh that the grid sees: the field is closed across them by a lid, and its distances are shortened.

Around an open mesh the winding number falls from 1 to 0 across the hole, and the sign flips where it is 1/2,
which is the plane of the hole's rim where that is plane. So far from any face the distance would jump from the
rim's to minus that. Where the sign flips there, lies a point of the lid; distances to these count too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..surface import Surface

TOUCHING = 1.01  # spacings: two nodes whose distances add up to more have no face between them


@dataclass(frozen=True)
class Lids:
    """What closes a mesh.

    Attributes:
        area: [m^2].
        width: Of the widest opening, as the largest disc that fits [m]; 0 where no opening is wider than
            the grid's spacing.
    """

    area: float
    width: float


def close_openings(distances: np.ndarray, winding: np.ndarray, ticks: np.ndarray) -> Lids:
    """Shorten the distances of an open mesh to its lids.

    Args:
        distances: Of the nodes to the mesh [m], shape (n, n, n), shortened in place.
        winding: Of the nodes, same shape.
        ticks: Positions of the nodes along x, y and z alike [m], shape (n,).
    """
    spacing = float(ticks[1] - ticks[0])
    points, gaps = [np.empty((0, 3))], [np.empty(0)]
    sides = np.zeros(3)
    for axis in range(3):
        d, w = np.moveaxis(distances, axis, 0), np.moveaxis(winding, axis, 0)
        flips = ((w[:-1] > 0.5) != (w[1:] > 0.5)) & (d[:-1] + d[1:] > TOUCHING * spacing)
        index = np.argwhere(flips)
        if len(index) == 0:
            continue
        start, end = tuple(index.T), tuple((index + [1, 0, 0]).T)
        share = (0.5 - w[start]) / (w[end] - w[start])
        place = index.astype(np.float64)
        place[:, 0] += share
        points.append(ticks[0] + spacing * np.insert(place[:, 1:], axis, place[:, 0], axis=1))
        gaps.append(np.minimum(d[start], d[end]))
        sides[axis] = len(index)
    lid = np.concatenate(points)
    if len(lid) == 0:
        return Lids(0.0, 0.0)
    width = 2.0 * float(np.concatenate(gaps).max())
    corners = np.repeat(
        np.arange(len(lid))[:, None], 3, axis=1
    )  # points, as triangles of no extent
    np.minimum(distances, Surface(lid, corners).grid_distances(ticks), out=distances)
    return Lids(float(np.linalg.norm(sides)) * spacing**2, width)
