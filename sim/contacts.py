# SPDX-License-Identifier: MIT
"""How far the simulated contacts are from those of rigid bodies with the object's true surface.

Two things stand between: the convex parts that MuJoCo computes contacts with are not quite the mesh, and soft
contacts let pad and object overlap. A contact bit is as true as these are small. A third is soft friction, by which
what is held creeps.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import trimesh

from vtgtsam import ObjectModel
from vtgtsam.exceptions import VtgtsamError
from vtgtsam.objects import mesh_of
from vtgtsam.surface import Surface

from . import constants as c
from .convex import convex_parts
from .sequence import SequenceName, Settings, make_trajectory
from .simulate import Trajectory

SAMPLES = 4000  # points on the convex parts' surface


@dataclass(frozen=True)
class SurfaceGap:
    """How the surface of an object's convex parts lies about the mesh.

    Attributes:
        parts: Number of parts.
        mean: Mean distance to the mesh [m].
        largest: 95th percentile of it [m].
    """

    parts: int
    mean: float
    largest: float


def surface_gap(obj: ObjectModel, seed: int = 0) -> SurfaceGap:
    """Compare the outer surface of an object's convex parts with its mesh.

    Args:
        obj: The object.
        seed: Of the points sampled.
    """
    mesh = mesh_of(obj)
    hulls = [trimesh.convex.convex_hull(points) for points in convex_parts(mesh)]
    areas = np.array([hull.area for hull in hulls])
    counts = np.ceil(SAMPLES * areas / areas.sum()).astype(int)
    points = np.concatenate(
        [hull.sample(count, seed=seed) for hull, count in zip(hulls, counts, strict=True)]
    )
    outer = points[~_inside_another(points, np.repeat(np.arange(len(hulls)), counts), hulls)]
    gap = Surface(mesh.vertices, mesh.faces).distances(outer)
    return SurfaceGap(len(hulls), float(gap.mean()), float(np.quantile(gap, 0.95)))


def _inside_another(
    points: np.ndarray, owner: np.ndarray, hulls: list[trimesh.Trimesh]
) -> np.ndarray:
    """Which points are cuts between parts: in or on a part other than their own."""
    hidden = np.zeros(len(points), dtype=bool)
    for index, hull in enumerate(hulls):
        offsets = np.einsum("fk,fk->f", hull.face_normals, hull.triangles[:, 0])
        heights = (points @ hull.face_normals.T - offsets).max(axis=1)
        hidden |= (owner != index) & (heights < 1e-5)
    return hidden


def overlaps(trajectory: Trajectory) -> np.ndarray:
    """By how much pads and object overlap [m], all contacts of all samples, shape (N,)."""
    values: np.ndarray = trajectory.overlap[~np.isnan(trajectory.overlap)]
    return values


def creep(trajectory: Trajectory) -> float:
    """How fast the object's origin moves in the hand while that is still, after the turn [m/s]."""
    T_ho = np.linalg.inv(trajectory.T_wh) @ trajectory.T_wo
    first = int(np.searchsorted(trajectory.time, c.TURN_END))
    way = np.linalg.norm(T_ho[-1, :3, 3] - T_ho[first, :3, 3])
    return float(way / (trajectory.time[-1] - trajectory.time[first]))


def table(settings: Settings, objects: Sequence[str]) -> Iterator[str]:
    """Lines to print, one for each object's first sequence and one for all of them, as they are computed."""
    yield f"{'':26s} {'parts against the mesh [mm]':>27s}   {'overlap in contact [mm]':>24s}   {'creep':>6s}"
    yield (
        f"{'object':20s} {'parts':>5s} {'mean':>13s} {'95 %':>13s}   {'95 %':>12s} {'deepest':>11s}"
        f"   {'[mm/s]':>6s}"
    )
    everything, speeds = [np.empty(0)], []
    for name in objects:
        try:
            world, trajectory = make_trajectory(settings, SequenceName(name, 0))
        except VtgtsamError as error:
            yield f"{name:20s} {error}"
            continue
        gap, overlap = surface_gap(world.obj), overlaps(trajectory)
        everything.append(overlap)
        speeds.append(creep(trajectory))
        yield (
            f"{name:20s} {gap.parts:5d} {1e3 * gap.mean:13.2f} {1e3 * gap.largest:13.2f}   "
            f"{1e3 * np.quantile(overlap, 0.95):12.3f} {1e3 * overlap.max():11.3f}   {1e3 * speeds[-1]:6.2f}"
        )
    overlap = np.concatenate(everything)
    if len(overlap):
        share, deepest = 1e3 * np.quantile(overlap, 0.95), 1e3 * overlap.max()
        median = 1e3 * np.median(speeds)
        yield (
            f"{'all, creep: median':20s} {'':5s} {'':13s} {'':13s}   {share:12.3f} {deepest:11.3f}"
            f"   {median:6.2f}"
        )
