# SPDX-License-Identifier: MIT
"""Is a mesh fit to be tracked? Units, holes, thin walls, and an audit of its distance field."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..exceptions import MeshError
from ..input.door import reading
from ..sdf.build import build_sdf
from ..sdf.sign import regions
from .orientation import outward
from .rays import Rays
from .reading import read_mesh

if TYPE_CHECKING:
    import trimesh

    from ..sdf.grid import GridSdf

SAMPLES = 20_000  # points at which the field is compared, and rays through walls
SEED = 0
ROUNDING = 1e-6  # of a distance that is kept as float32, and more
STEP = 1e-6  # of the extent: where rays begin, off a face
ENOUGH_HIT = 0.9  # of the rays through walls
CROSSED = 2000  # points in an open mesh's grid from which rays are cast
WRONG_POINTS = 0.01  # of them: rays meet cracks
WRONG_AREA = 0.005  # of the surface: what is left out of account, slivers and seams
INNER_AREA = 0.05  # of the surface within the object, which shortens depths
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
    with reading(path, MeshError):
        return _looked_over(mesh, scale, resolution)


def _looked_over(mesh: trimesh.Trimesh, scale: float, resolution: int) -> MeshReport:
    report = MeshReport()
    report.lines.extend(_describe(mesh, scale))
    try:
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            sdf = build_sdf(mesh, resolution)
        turned, closed, _ = outward(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    except MeshError as error:  # nothing more can be measured
        report.problems.append(str(error))
        return report
    report.problems.extend(str(warning.message) for warning in said)
    _check_walls(turned, sdf, report)
    air, solid = _sides(mesh, sdf)
    _audit_distances(mesh, sdf, closed, solid, report)
    (_audit_reached if closed else _audit_crossings)(mesh, sdf, report)
    _audit_sides(air, solid, report)
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
    hit = np.isfinite(thickness)
    if hit.mean() < ENOUGH_HIT:
        report.problems.append(
            f"only {100 * hit.mean():.0f} % of rays straight into the mesh meet its other side: it is open, or "
            "no body, and thin walls were looked for in that part alone"
        )
    if not hit.any():
        return
    thickness = thickness[hit]
    thinnest = float(np.quantile(thickness, THIN_AREA))
    report.lines.append(
        f"walls: {100 * (1 - THIN_AREA):.0f} % of the surface has more than {thinnest * 1e3:.2f} mm "
        f"of material behind it; the field has a node every {voxel * 1e3:.2f} mm"
    )
    thin = float((thickness < 2 * voxel).mean())
    if thin > THIN_AREA:
        enough = int(np.ceil((len(sdf.values) - 1) * 2 * voxel / max(thinnest, voxel / 50))) + 1
        report.problems.append(
            f"{100 * thin:.0f} % of the surface belongs to walls thinner than two voxels "
            f"({2e3 * voxel:.2f} mm), which the field blurs; a resolution of {enough} would keep them "
            "(--resolution, or resolution= of load_object and in a topic map)"
        )


def _thickness(mesh: trimesh.Trimesh) -> np.ndarray:
    """Material behind points spread evenly over the surface, straight inwards [m]; inf where it is open."""
    import trimesh

    points, face = trimesh.sample.sample_surface(mesh, SAMPLES, seed=SEED)
    inwards = -np.asarray(mesh.face_normals)[face]
    step = STEP * float(mesh.extents.max())  # past the face itself
    rays = Rays(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    return rays.first(points + step * inwards, inwards)


def _audit_distances(
    mesh: trimesh.Trimesh, sdf: GridSdf, closed: bool, solid: float, report: MeshReport
) -> None:
    """Compare the interpolated field with exact distances to the mesh as it came.

    Lids that close it shorten distances; inner walls that were left out make them longer.
    """
    import igl

    vertices, faces = np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int64)
    points = _audit_points(mesh, sdf)
    squared, _, _ = igl.point_mesh_squared_distance(points, vertices, faces)
    exact, value = np.sqrt(squared), sdf.value(points)
    limit = float(np.linalg.norm(sdf.spacing)) / 2
    left_out = np.zeros(len(points), dtype=bool)
    if not closed:
        left_out |= exact - np.abs(value) > limit
    if solid > 0:
        left_out |= -value - exact > limit
    error = np.abs(np.abs(value) - exact)[~left_out]
    report.lines.append(
        f"distance field at {len(error)} points: error {np.mean(error) * 1e3:.3f} mm in the mean, "
        f"{np.max(error) * 1e3:.3f} mm at most (half a voxel diagonal is {limit * 1e3:.3f} mm)"
        + (
            f"; {int(left_out.sum())} points at lids and inner walls left out"
            if left_out.any()
            else ""
        )
    )
    if np.max(error) > 2 * limit:
        report.problems.append(
            f"the distance field is wrong by up to {np.max(error) * 1e3:.1f} mm; faces of the mesh were left "
            "out in its making; close its holes and recalculate its normals in a mesh editor"
        )


def _audit_points(mesh: trimesh.Trimesh, sdf: GridSdf) -> np.ndarray:
    """Half of them anywhere in the grid, half within two voxels of the surface."""
    import trimesh

    rng = np.random.default_rng(SEED)
    anywhere = rng.uniform(sdf.lower, sdf.upper, size=(SAMPLES // 2, 3))
    surface, _ = trimesh.sample.sample_surface(mesh, SAMPLES // 2, seed=SEED)
    near = surface + rng.uniform(-2, 2, size=surface.shape) * sdf.spacing
    return np.concatenate([anywhere, near])


def _audit_reached(mesh: trimesh.Trimesh, sdf: GridSdf, report: MeshReport) -> None:
    """Look for wrong signs of a closed mesh: what is reached from outside without crossing a face.

    This depends on no face's direction.
    """
    distances = np.abs(sdf.values).astype(np.float64) * (1 - ROUNDING)
    region = regions(distances, float(sdf.spacing.max()))
    reached = region == region[0]
    wrong = int((reached & (sdf.values.ravel() < 0)).sum())
    report.lines.append(
        f"signs: {wrong} wrong of {int(reached.sum())} nodes that can be reached from outside"
    )
    if wrong > 0:
        report.problems.append(
            f"the distance field has the wrong sign at {wrong} nodes that can be reached from outside; do not "
            "use this mesh before its holes are closed and its normals recalculated"
        )


def _audit_crossings(mesh: trimesh.Trimesh, sdf: GridSdf, report: MeshReport) -> None:
    """Look for wrong signs of an open mesh: rays from outside cross an even number of faces, most of them.

    This depends on no face's direction either. Where rays do not agree, near holes, nothing is said.
    """
    rng = np.random.default_rng(SEED)
    points = rng.uniform(sdf.lower, sdf.upper, size=(CROSSED, 3))
    value = sdf.value(points)
    rays = Rays(np.asarray(mesh.vertices), np.asarray(mesh.faces))
    even = rays.outside(points, rng, rays=9)
    clear = (np.abs(even - 0.5) > 0.35) & (np.abs(value) > np.linalg.norm(sdf.spacing))
    wrong = int(((even > 0.5) != (value > 0))[clear].sum())
    report.lines.append(
        f"signs: {wrong} wrong of {int(clear.sum())} points whose rays agree on which side they lie"
    )
    if wrong > WRONG_POINTS * clear.sum():
        report.problems.append(
            f"the distance field has the wrong sign at {wrong} of {int(clear.sum())} points, by the faces that rays "
            "cross; do not use this mesh before its holes are closed and its normals recalculated"
        )


def _audit_sides(air: float, solid: float, report: MeshReport) -> None:
    """A face has the inside on one of its sides alone, whichever way it looks."""
    report.lines.append(
        f"sides: {100 * air:.1f} % of the surface has the outside on both, {100 * solid:.1f} % the inside"
    )
    if air > WRONG_AREA:
        report.problems.append(
            f"{100 * air:.1f} % of the surface has the outside on both of its sides in the distance field: "
            "sheets without a thickness, or parts with a wrong sign; do not use this mesh before its holes "
            "are closed and its normals recalculated"
        )
    if solid > INNER_AREA:
        report.problems.append(
            f"{100 * solid:.0f} % of the surface lies within the object (parts that overlap, inner walls): a point "
            "deep inside takes them for the surface; unite the parts or delete what lies within in a mesh "
            "editor, or turn the faces of a cavity so that they look into it"
        )


def _sides(mesh: trimesh.Trimesh, sdf: GridSdf) -> tuple[float, float]:
    """Shares of the surface with the outside, and with the inside, on both sides, a voxel away.

    Only where no other face is near: within thinner walls there is nothing to be seen.
    """
    import trimesh

    points, face = trimesh.sample.sample_surface(mesh, SAMPLES, seed=SEED)
    out = np.asarray(mesh.face_normals)[face]
    off = float(sdf.spacing.max())
    front, back = (sdf.value(points + side * off * out) for side in (1, -1))
    clear = (np.abs(np.abs(front) - off) < off / 4) & (np.abs(np.abs(back) - off) < off / 4)
    rays, step = Rays(np.asarray(mesh.vertices), np.asarray(mesh.faces)), STEP * mesh.extents.max()
    for side in (1, -1):
        clear &= rays.first(points + side * step * out, side * out) > 1.5 * off
    return float((clear & (front > 0) & (back > 0)).mean()), float(
        (clear & (front < 0) & (back < 0)).mean()
    )
