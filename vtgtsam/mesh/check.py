# SPDX-License-Identifier: MIT
"""Is a mesh fit to be tracked? Units, holes, thin walls, and an audit of its distance field."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..exceptions import MeshError
from ..sdf.build import build_sdf
from .orientation import outward
from .reading import check_size, read_mesh

if TYPE_CHECKING:
    import trimesh

    from ..sdf.grid import GridSdf

SAMPLES = 20_000  # points at which the field is compared, and rays through walls
SEED = 0
THIN_AREA = 0.01  # of the surface, below which thin walls are not worth a word: sharp edges


@dataclass(frozen=True)
class MeshReport:
    """What is known about a mesh.

    Attributes:
        lines: Facts, one a line.
        problems: What is wrong and what to do about it, one sentence each; empty where all is well.
    """

    lines: list[str] = field(default_factory=list)
    problems: list[str] = field(default_factory=list)

    def __str__(self) -> str:
        verdict = [f"problem: {problem}" for problem in self.problems] or ["no problems found"]
        return "\n".join([*self.lines, *verdict])


def check_mesh(path: str | Path, scale: float = 1.0, resolution: int = 128) -> MeshReport:
    """Look a mesh over as ``load_object`` would use it.

    Args:
        path: Mesh file.
        scale: Metres per unit of the file.
        resolution: Nodes along each side of the distance field.

    Raises:
        MeshError: The file cannot be read as a mesh.
    """
    mesh = read_mesh(path)
    mesh.apply_scale(scale)
    report = MeshReport()
    report.lines.extend(_describe(mesh, scale))
    try:
        check_size(np.asarray(mesh.vertices))
        turned, _, problems = outward(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    except MeshError as error:  # nothing more can be measured
        report.problems.append(str(error))
        return report
    report.problems.extend(problems)
    with warnings.catch_warnings(action="ignore"):  # those very problems
        sdf = build_sdf(mesh, resolution)
    _check_walls(turned, sdf, report)
    _audit(turned, sdf, report)
    return report


def _describe(mesh: trimesh.Trimesh, scale: float) -> list[str]:
    x, y, z = mesh.extents * 1e3
    center = mesh.bounds.mean(axis=0) * 1e3
    _, edges = np.unique(mesh.edges_sorted, axis=0, return_counts=True)
    lines = [
        f"extents: {x:.1f} x {y:.1f} x {z:.1f} mm at scale {scale:g}",
        f"centre of the bounding box: {center[0]:.1f}, {center[1]:.1f}, {center[2]:.1f} mm "
        "from the file's origin",
        f"{len(mesh.faces)} faces, {len(mesh.vertices)} vertices, {mesh.body_count} "
        + ("body" if mesh.body_count == 1 else "bodies"),
    ]
    if mesh.is_watertight:
        lines.append(f"watertight, volume {_volume(mesh.volume)}")
    else:
        lines.append(f"not watertight: {int((edges != 2).sum())} edges do not join two faces")
    return lines


def _volume(cubic_metres: float) -> str:
    """A volume with its unit; what is not in metres can be as large as a house."""
    if abs(cubic_metres) < 1.0:
        return f"{cubic_metres * 1e6:.1f} cm3"
    return f"{cubic_metres:,.0f} m3"


def _check_walls(mesh: trimesh.Trimesh, sdf: GridSdf, report: MeshReport) -> None:
    """Walls thinner than two voxels vanish between the nodes."""
    voxel = float(sdf.spacing.max())
    thickness = _thickness(mesh)
    if len(thickness) == 0:
        return
    thinnest = float(np.quantile(thickness, THIN_AREA))
    report.lines.append(
        f"walls: {100 * (1 - THIN_AREA):.0f} % of the surface has more than {thinnest * 1e3:.2f} mm "
        f"of material behind it; the field has a node every {voxel * 1e3:.2f} mm"
    )
    thin = float((thickness < 2 * voxel).mean())
    if thin > THIN_AREA:
        enough = int(np.ceil((len(sdf.values) - 1) * 2 * voxel / thinnest)) + 1
        report.problems.append(
            f"{100 * thin:.0f} % of the surface belongs to walls thinner than two voxels "
            f"({2e3 * voxel:.2f} mm), which the field blurs; a resolution of {enough} would keep them"
        )


def _thickness(mesh: trimesh.Trimesh) -> np.ndarray:
    """Material behind points spread evenly over the surface, straight inwards [m]."""
    import igl
    import trimesh

    points, face = trimesh.sample.sample_surface(mesh, SAMPLES, seed=SEED)
    inwards = -np.asarray(mesh.face_normals)[face]
    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int64)
    tree = igl.AABB()
    tree.init(vertices, faces)
    step = 1e-6 * float(mesh.extents.max())  # past the face itself
    hit, length, _ = tree.intersect_ray_first(vertices, faces, points + step * inwards, inwards)
    return np.asarray(length[hit >= 0])


def _audit(mesh: trimesh.Trimesh, sdf: GridSdf, report: MeshReport) -> None:
    """Compare the interpolated field with exact distances and winding numbers."""
    import igl

    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int64)
    points = _audit_points(mesh, sdf)
    squared, _, _ = igl.point_mesh_squared_distance(points, vertices, faces)
    inside = igl.winding_number(vertices, faces, points) > 0.5
    exact = np.where(inside, -np.sqrt(squared), np.sqrt(squared))
    error = np.abs(sdf.value(points) - exact)
    limit = float(np.linalg.norm(sdf.spacing)) / 2
    wrong = int(((sdf.value(points) < 0) != inside)[np.abs(exact) > limit].sum())
    report.lines.append(
        f"distance field at {len(points)} points: error {np.mean(error) * 1e3:.3f} mm in the mean, "
        f"{np.max(error) * 1e3:.3f} mm at most (half a voxel diagonal is {limit * 1e3:.3f} mm), "
        f"{wrong} wrong signs"
    )
    if wrong > 0:
        report.problems.append(
            f"the distance field has the wrong sign at {wrong} of {len(points)} points; do not use "
            "this mesh before its holes are closed and its normals recalculated"
        )


def _audit_points(mesh: trimesh.Trimesh, sdf: GridSdf) -> np.ndarray:
    """Half of them anywhere in the grid, half within two voxels of the surface."""
    import trimesh

    rng = np.random.default_rng(SEED)
    anywhere = rng.uniform(sdf.lower, sdf.upper, size=(SAMPLES // 2, 3))
    surface, _ = trimesh.sample.sample_surface(mesh, SAMPLES // 2, seed=SEED)
    near = surface + rng.uniform(-2, 2, size=surface.shape) * sdf.spacing
    return np.concatenate([anywhere, near])
