# SPDX-License-Identifier: MIT
"""What rays from one point meet first in a MuJoCo scene."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from ..camera import CameraIntrinsics
from .loops import cast
from .solids import BOX, CAPSULE, CYLINDER, MESH, SPHERE

if TYPE_CHECKING:
    import mujoco

KINDS = (SPHERE, CAPSULE, CYLINDER, BOX, MESH)


class Met(NamedTuple):
    """What rays met.

    Attributes:
        geom: Number of the geom, -1 where none, shape (N,), int32.
        distance: Distance in lengths of the ray, -1 where nothing was met, shape (N,).
        normals_w: The surface's normals in the world frame, zero where nothing was met, shape (N, 3).
    """

    geom: np.ndarray
    distance: np.ndarray
    normals_w: np.ndarray


@dataclass(frozen=True)
class RayGrid:
    """Rays from one point, sorted by the pixel of an image that they pass.

    Attributes:
        camera: The image's intrinsics.
        R_wc: Orientation of its camera, shape (3, 3).
        rays_w: The rays, row by row of the image, shape (N, 3).
        starts: The first ray of each pixel, and the row's end, shape (height, width + 1).
        spread: How far from its pixel's middle a ray may pass [pixels].
    """

    camera: CameraIntrinsics
    R_wc: np.ndarray
    rays_w: np.ndarray
    starts: np.ndarray
    spread: float

    @classmethod
    def image(cls, camera: CameraIntrinsics, R_wc: np.ndarray, rays_w: np.ndarray) -> RayGrid:
        """One ray for each pixel, through its middle, shape (height * width, 3)."""
        firsts = np.arange(camera.height * camera.width + 1)
        return cls(camera, R_wc, rays_w, _by_pixel(firsts, camera), spread=0.0)

    @classmethod
    def sort(cls, R_wc: np.ndarray, rays_w: np.ndarray, focal: float) -> tuple[RayGrid, np.ndarray]:
        """Any rays in front of a camera that has ``focal`` pixels at 1 m, and their numbers in the grid's order."""
        rays_c = rays_w @ R_wc
        pixels = np.rint(focal * rays_c[:, :2] / rays_c[:, 2:]).astype(np.int64)
        left, top = pixels.min(axis=0).tolist()
        width, height = (pixels.max(axis=0) - (left, top) + 1).tolist()
        camera = CameraIntrinsics(width, height, focal, focal, -left, -top)
        pixel = (pixels[:, 1] - top) * width + pixels[:, 0] - left
        order = np.argsort(pixel, kind="stable")
        firsts = np.concatenate([[0], np.cumsum(np.bincount(pixel, minlength=width * height))])
        return cls(camera, R_wc, rays_w[order], _by_pixel(firsts, camera), spread=0.5), order


def _by_pixel(firsts: np.ndarray, camera: CameraIntrinsics) -> np.ndarray:
    """``RayGrid.starts`` of the first ray of each pixel, and the end of all, shape (height * width + 1,)."""
    rows = camera.width * np.arange(camera.height)[:, None]
    starts: np.ndarray = firsts[rows + np.arange(camera.width + 1)].astype(np.int64)
    return starts


class RayCaster:
    """Casts rays at the geoms of a scene, with the results of ``mj_ray``.

    A scene with planes, ellipsoids, height fields or distance fields is left to ``mj_multiRay``.

    Args:
        model: The compiled scene.
        groups: Groups of geoms that are met.
    """

    def __init__(self, model: mujoco.MjModel, groups: tuple[int, ...]) -> None:
        self._model = model
        self._groups = np.isin(np.arange(6), groups).astype(np.uint8)
        self._geoms = _opaque(model, groups)
        self._are_known = bool(np.isin(model.geom_type[self._geoms], KINDS).all())
        self._meshes = _meshes(model)

    def cast(self, data: mujoco.MjData, origin_w: np.ndarray, rays: RayGrid) -> Met:
        """What rays from a point meet at the poses ``data`` holds (after ``mj_kinematics``)."""
        model, camera, count = self._model, rays.camera, len(rays.rays_w)
        met = Met(np.empty(count, dtype=np.int32), np.empty(count), np.zeros((count, 3)))
        if not self._are_known:
            return self._by_mujoco(data, origin_w, rays.rays_w, met)
        cast(
            self._geoms, model.geom_type, model.geom_size, model.geom_aabb, data.geom_xpos,
            data.geom_xmat.reshape(-1, 3, 3), self._meshes, model.mesh_vert, model.mesh_face,
            origin_w, np.ascontiguousarray(rays.R_wc),
            np.array([camera.fx, camera.fy, camera.cx, camera.cy, rays.spread]),
            rays.rays_w, rays.starts, *met,
        )  # fmt: skip
        return met

    def _by_mujoco(
        self, data: mujoco.MjData, origin_w: np.ndarray, rays_w: np.ndarray, met: Met
    ) -> Met:
        import mujoco

        mujoco.mj_multiRay(
            self._model, data, origin_w, rays_w.ravel(), self._groups, 1, -1,
            met.geom, met.distance, met.normals_w.reshape(-1), len(rays_w), mujoco.mjMAXVAL,
        )  # fmt: skip
        return met


def _opaque(model: mujoco.MjModel, groups: tuple[int, ...]) -> np.ndarray:
    """Numbers of the geoms of some groups that are not wholly transparent."""
    alpha = model.geom_rgba[:, 3].copy()
    painted = model.geom_matid >= 0
    alpha[painted] = model.mat_rgba[model.geom_matid[painted], 3]
    numbers: np.ndarray = np.flatnonzero((alpha > 0.0) & np.isin(model.geom_group, groups))
    return numbers


def _meshes(model: mujoco.MjModel) -> np.ndarray:
    """Where the vertices and faces of each geom's mesh begin and end, shape (G, 4)."""
    meshes = np.zeros((model.ngeom, 4), dtype=np.int64)
    geoms = np.flatnonzero(model.geom_type == MESH)
    mesh = model.geom_dataid[geoms]
    for column, first, count in (
        (0, model.mesh_vertadr, model.mesh_vertnum),
        (2, model.mesh_faceadr, model.mesh_facenum),
    ):
        meshes[geoms, column] = first[mesh]
        meshes[geoms, column + 1] = first[mesh] + count[mesh]
    return meshes
