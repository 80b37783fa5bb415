# SPDX-License-Identifier: MIT
"""How long a signed distance field takes to build and to read from the cache, and how exact it is."""

from __future__ import annotations

import os
import tempfile
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import numpy as np

from vtgtsam import GridSdf, build_sdf
from vtgtsam.shapes import CATALOGUE

from .clock import timed
from .report import save, table
from .scaling import SLOPE, slope

if TYPE_CHECKING:
    import trimesh
    from matplotlib.figure import Figure

OBJECT = "bottle"  # 10,080 faces
RESOLUTIONS = (32, 64, 128, 256)
REPEATS = 3
POINTS = 10_000  # compared of each kind

EXPLAINED = (
    "Medians of {repeats}, time on the clock, {processors} processor(s). Errors are the largest of {points} nodes, and "
    "of the value between nodes at {points} points, half anywhere in the grid and half within two voxels of "
    "the surface, in halves of a voxel's diagonal; the reference is libigl's, distance and exact winding number. Signs "
    "count where the surface is further than rounding."
)


def run(largest: int = RESOLUTIONS[-1]) -> None:
    """Measure, and write ``field.md``, ``field.json`` and ``field.png``."""
    meshes = {"closed": CATALOGUE[OBJECT].mesh(), "with a hole": holed(CATALOGUE[OBJECT].mesh())}
    build_sdf(meshes["closed"], resolution=8)  # compiles
    resolutions = [n for n in (*RESOLUTIONS, 512) if n <= largest]
    rows: list[dict[str, Any]] = [
        {"mesh": name, "faces": len(mesh.faces), "nodes a side": n}
        | times(mesh, n)
        | errors(mesh, n)
        for name, mesh in meshes.items()
        for n in resolutions
    ]
    curves = {
        name: [row["without cache [s]"] for row in rows if row["mesh"] == name] for name in meshes
    }
    slopes = {name: slope(resolutions, seconds) for name, seconds in curves.items()}
    explained = EXPLAINED.format(
        repeats=REPEATS, processors=len(os.sched_getaffinity(0)), points=POINTS
    )
    text = [explained, "", table(rows), ""]
    text += [f"Slope in the nodes a side, {name}: {s:.2f}. {SLOPE}" for name, s in slopes.items()]
    save(
        "field",
        "\n".join(text),
        {"rows": rows, "slopes": slopes},
        {"field": figure(rows, slopes)},
    )


def holed(mesh: trimesh.Trimesh) -> trimesh.Trimesh:
    """The mesh without the hundredth of its faces that is highest."""
    highest = mesh.triangles_center[:, 2].argsort()[-len(mesh.faces) // 100 :]
    mesh.update_faces(np.setdiff1d(np.arange(len(mesh.faces)), highest))
    return mesh


def times(mesh: trimesh.Trimesh, resolution: int) -> dict[str, float]:
    """How long a field takes, without cache and from the cache."""
    built, read = [], []
    for _ in range(REPEATS):
        with _empty_cache():
            built.append(_seconds(lambda: _field(mesh, resolution)))
            read.append(_seconds(lambda: _field(mesh, resolution)))
    return {
        "without cache [s]": float(np.median(built)),
        "from the cache [ms]": 1e3 * float(np.median(read)),
    }


def errors(mesh: trimesh.Trimesh, resolution: int) -> dict[str, float]:
    """Largest errors in halves of a voxel's diagonal, and the share of right signs at nodes."""
    import trimesh

    with _empty_cache():
        sdf = _field(mesh, resolution)
    rng = np.random.default_rng(0)
    nodes = rng.integers(0, sdf.values.shape, (POINTS, 3))
    at_nodes = exact(mesh, sdf.lower + nodes * sdf.spacing)
    stored = sdf.values[tuple(nodes.T)]
    surface, _ = trimesh.sample.sample_surface(mesh, POINTS // 2, seed=0)
    near = surface + rng.uniform(-2, 2, surface.shape) * sdf.spacing
    points = np.concatenate([near, rng.uniform(sdf.lower, sdf.upper, (POINTS // 2, 3))])
    half = float(np.linalg.norm(sdf.spacing)) / 2
    clear = np.abs(at_nodes) > 1e-9
    return {
        "error at nodes": float(np.abs(stored - at_nodes).max()) / half,
        "error between nodes": float(np.abs(sdf.value(points) - exact(mesh, points)).max()) / half,
        "right signs [%]": 1e2 * float(np.mean((stored < 0)[clear] == (at_nodes < 0)[clear])),
    }


def exact(mesh: trimesh.Trimesh, points: np.ndarray) -> np.ndarray:
    """Signed distances [m] as libigl computes them, the sign by the exact winding number."""
    import igl

    V, F = np.asarray(mesh.vertices), np.asarray(mesh.faces, dtype=np.int64)
    squared, _, _ = igl.point_mesh_squared_distance(points, V, F)
    inside = igl.winding_number(V, F, points) > 0.5
    return np.asarray(np.where(inside, -1.0, 1.0) * np.sqrt(squared))


def _field(mesh: trimesh.Trimesh, resolution: int) -> GridSdf:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # the hole is meant to be there
        return build_sdf(mesh, resolution=resolution)


def _seconds(call: Callable[[], object]) -> float:
    return timed(call)[0].wall


@contextmanager
def _empty_cache() -> Iterator[None]:
    before = os.environ.get("VTGTSAM_CACHE")
    with tempfile.TemporaryDirectory() as folder:
        os.environ["VTGTSAM_CACHE"] = folder
        try:
            yield
        finally:
            del os.environ["VTGTSAM_CACHE"]
            if before is not None:
                os.environ["VTGTSAM_CACHE"] = before


def figure(rows: list[dict[str, Any]], slopes: dict[str, float]) -> Figure:
    """Times over nodes a side in logarithms, with those to reach at 128."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import NullFormatter

    chart = Figure(figsize=(5.5, 3.8), layout="constrained")
    axes = chart.subplots()
    nodes = sorted({row["nodes a side"] for row in rows})
    for n, (name, exponent) in enumerate(slopes.items()):
        of_mesh = [row for row in rows if row["mesh"] == name]
        built = [row["without cache [s]"] for row in of_mesh]
        read = [row["from the cache [ms]"] / 1e3 for row in of_mesh]
        axes.plot(nodes, built, "o-", color=f"C{n}", label=f"built, {name}, slope {exponent:.2f}")
        axes.plot(nodes, read, "o--", color=f"C{n}", label=f"from the cache, {name}")
    axes.plot([128, 128], [2.0, 0.05], "kv", label="to be below")
    axes.set_xscale("log")
    axes.set_yscale("log")
    axes.set_xticks(nodes, [str(n) for n in nodes])
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.set_xlabel("nodes a side")
    axes.set_ylabel("time [s]")
    axes.grid(alpha=0.3, which="both")
    axes.legend(fontsize="small")
    return chart
