# SPDX-License-Identifier: MIT
"""The scene that pictures are taken of: a hand, an object and estimates of it, in good light.

Nothing is simulated in it, so it needs nothing but the hand's and the object's geometry.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from typing import TYPE_CHECKING

import mujoco
import numpy as np

from vtgtsam import HandModel, Recording
from vtgtsam.covariance import center_ellipsoid
from vtgtsam.evaluation import palette
from vtgtsam.exceptions import VtgtsamError
from vtgtsam.objects import mesh_of

from ..appearance import Color, color_of, of_palette
from ..hands import load_description
from ..scene import HAND, hand_with_pads, pad_geom, take_options
from .instants import Instant

if TYPE_CHECKING:
    import trimesh

OBJECT, FOREARM = "object", "forearm"
TOUCHING = (1.0, 0.82, 0.12)  # colour of a pad in contact, which glows
TINGED = (0.93, 0.82, 0.45)  # colour of the links that carry such pads
FREE = (0.20, 0.24, 0.29)
GLOW = 0.45  # emission, 0 to 1
SWELL = (
    0.01  # links that are tinged are drawn so much larger: their neighbours have the same surface
)
STEP = 0.003  # and each geom of a link so much larger than the one before, for the same reason
TRUTH = of_palette(palette.TRUTH)  # where estimates are shown
EDGES = (0.42, 0.44, 0.47)  # of the truth's box, whose faces are lighter
OUTLINE = 0.0012  # [m], radius of a box's edges
REGION = 0.35  # opacity of the ellipsoids
LARGEST = (
    0.15  # [m], half axis of an ellipsoid that is still drawn: in a larger one nothing else is seen
)
# Place relative to the middle of the picture [m], colour, and whether it casts shadows.
KEY_LIGHT = ((0.35, -0.45, 0.9), (0.55, 0.53, 0.50), True)
FILL_LIGHT = ((-0.5, 0.6, 0.5), (0.16, 0.18, 0.22), False)


class Stage:
    """A hand and an object that can be put anywhere.

    Args:
        recording: Whose hand and object.
        colors: Of the estimates that are shown; the object itself is grey beside them.

    Attributes:
        model: Its MuJoCo model.
        data: Where everything is.
    """

    def __init__(self, recording: Recording, colors: Sequence[Color] = ()) -> None:
        hand, mesh = recording.hand, mesh_of(recording.object)
        spec = mujoco.MjSpec()
        spec.compiler.boundmass, spec.compiler.boundinertia = 1e-6, 1e-9
        spec.compiler.balanceinertia = True
        _light(spec)
        _add_hand(spec, recording)
        _add_object(
            spec, mesh, (*TRUTH, 0.6) if colors else (*color_of(recording.object.name), 1.0)
        )
        self.model = spec.compile()
        self.data = mujoco.MjData(self.model)
        self._hand = hand
        self._qpos = [self.model.joint(HAND + name).qposadr[0] for name in hand.joint_names]
        self._pads = [self.model.geom(pad_geom(name)).id for name in hand.pad_names]
        self._links = _links_of_pads(self.model, self._pads)
        self._ranks = np.arange(self.model.ngeom) - self.model.body_geomadr[self.model.geom_bodyid]
        self._colors = self.model.geom_rgba.copy()
        self._box = np.array(list(itertools.product(*mesh.bounds.T)))  # corners, object frame
        self._center = recording.object.center
        self._estimates = colors
        self._shown: Instant | None = None

    def show(self, instant: Instant) -> None:
        """Put everything where it was; what is not known is not shown."""
        self.data.qpos[self._qpos] = instant.joints
        self._move(HAND, instant.T_wh)
        colors = self._colors.copy()
        if instant.T_wo is None:
            colors[self.model.geom(OBJECT).id, 3] = 0.0
        else:
            self._move(OBJECT, instant.T_wo)
        for pad, links, touches in zip(self._pads, self._links, instant.contacts, strict=True):
            colors[pad, :3] = TOUCHING if touches else FREE
            if touches:
                colors[links, :3] = TINGED
        self.model.geom_rgba[:] = colors
        mujoco.mj_kinematics(self.model, self.data)
        mujoco.mj_camlight(self.model, self.data)
        self._shown = instant

    def finish(self, scene: mujoco.MjvScene) -> None:
        """Let the pads in contact glow in a scene made of this stage, and add the estimates to it."""
        instant = self._shown
        assert instant is not None
        touching = np.flatnonzero(instant.contacts)
        glowing = {self._pads[k] for k in touching}
        tinged = {link for k in touching for link in self._links[k]}
        for geom in scene.geoms[: scene.ngeom]:
            if geom.objtype != mujoco.mjtObj.mjOBJ_GEOM:
                continue
            geom.size[:] *= 1 + STEP * self._ranks[geom.objid]
            if geom.objid in glowing:
                geom.emission = GLOW
            elif geom.objid in tinged:
                geom.size[:] *= 1 + SWELL
        if self._estimates and instant.T_wo is not None:
            self._add_box(scene, instant.T_wo, EDGES)
        shown = zip(self._estimates, instant.estimates, instant.covariances, strict=True)
        for color, T, covariance in shown:
            if T is not None:
                self._add_box(scene, T, color)
                self._add_region(scene, T, covariance, color)

    def _add_box(self, scene: mujoco.MjvScene, T: np.ndarray, color: Color) -> None:
        """The edges of the object's box where it is at T, (4, 4)."""
        corners = T[:3, 3] + self._box @ T[:3, :3].T
        for a, b in itertools.combinations(range(8), 2):
            if (a ^ b).bit_count() == 1:
                geom = _added(scene, mujoco.mjtGeom.mjGEOM_CAPSULE, (*color, 1.0))
                mujoco.mjv_connector(
                    geom, mujoco.mjtGeom.mjGEOM_CAPSULE, OUTLINE, corners[a], corners[b]
                )
                geom.emission = 0.2

    def _add_region(
        self, scene: mujoco.MjvScene, T: np.ndarray, covariance: np.ndarray, color: Color
    ) -> None:
        """The ellipsoid in which a method expects the object's centre with 95 %, unless it hides the scene."""
        region = center_ellipsoid(T[:3, :3], covariance, self._center)
        if region is not None and region[0].max() <= LARGEST:
            half, axes = region
            geom = _added(scene, mujoco.mjtGeom.mjGEOM_ELLIPSOID, (*color, REGION))
            geom.size[:], geom.mat[:] = half, axes
            geom.pos[:] = T[:3, 3] + T[:3, :3] @ self._center
            geom.emission = 0.3

    def light(self, middle: np.ndarray) -> None:
        """Let the lights stand around a point [m], shape (3,), world frame."""
        self.model.light_pos[:] = middle + (KEY_LIGHT[0], FILL_LIGHT[0])
        self.model.stat.center[:] = middle

    def extent(self, instant: Instant) -> np.ndarray:
        """Corners of boxes around all that is to be in the picture [m], shape (N, 3), world frame."""
        model = self.model
        self.show(instant)
        away = {model.geom(name).id for name in self._absent(instant)}
        seen = [g for g in range(model.ngeom) if model.geom_group[g] <= 2 and g not in away]
        return np.concatenate([_corners(model, self.data, g) for g in seen])

    def _absent(self, instant: Instant) -> list[str]:
        """Names of geoms that may lie outside the picture."""
        names = (
            [FOREARM]
            if FOREARM in {self.model.geom(g).name for g in range(self.model.ngeom)}
            else []
        )
        return names if instant.T_wo is not None else [*names, OBJECT]

    def _move(self, body: str, T: np.ndarray) -> None:
        """Bodies without joints are where the model has them, so the model is changed."""
        place = self.model.body(body)
        place.pos[:] = T[:3, 3]
        mujoco.mju_mat2Quat(place.quat, np.ascontiguousarray(T[:3, :3]).ravel())


def _light(spec: mujoco.MjSpec) -> None:
    spec.visual.headlight.ambient = (0.42, 0.42, 0.44)
    spec.visual.headlight.diffuse = (0.22, 0.22, 0.22)
    spec.visual.headlight.specular = (0.05, 0.05, 0.05)
    spec.stat.extent = 0.3  # [m], half the width of what casts shadows, and the unit of these:
    spec.visual.map.znear, spec.visual.map.zfar, spec.visual.map.shadowclip = 0.1, 60.0, 1.0
    spec.visual.quality.shadowsize = 1024
    spec.add_texture(
        name="sky",
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=(0.97, 0.98, 0.99),
        rgb2=(0.80, 0.84, 0.89),
        width=256,
        height=256,
    )
    for place, color, shadow in (KEY_LIGHT, FILL_LIGHT):
        light = spec.worldbody.add_light(pos=place, dir=-np.array(place), castshadow=shadow)
        light.type = mujoco.mjtLightType.mjLIGHT_DIRECTIONAL
        light.diffuse, light.specular = color, 0.4 * np.array(color) * shadow


def _add_hand(spec: mujoco.MjSpec, recording: Recording) -> None:
    hand: HandModel = recording.hand
    body = spec.worldbody.add_body(name=HAND)
    copy = hand_with_pads(hand)
    take_options(copy, spec)
    spec.attach(copy, prefix=HAND, frame=body.add_frame())
    try:  # hands that the simulator knows have something that carries them
        forearm = load_description(recording.info.get("hand", "")).forearm
    except VtgtsamError:
        return
    if forearm is not None:
        body.add_geom(
            name=FOREARM,
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            fromto=[*forearm.start, *forearm.end],
            size=(forearm.radius, 0, 0),
            rgba=(0.30, 0.31, 0.34, 1.0),
        )


def _add_object(
    spec: mujoco.MjSpec, mesh: trimesh.Trimesh, rgba: tuple[float, float, float, float]
) -> None:
    spec.add_mesh(
        name=OBJECT,
        uservert=np.asarray(mesh.vertices, dtype=np.float64).ravel(),
        userface=np.asarray(mesh.faces, dtype=np.int32).ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,  # not used; an open mesh fails otherwise
    )
    body = spec.worldbody.add_body(name=OBJECT)
    body.add_geom(name=OBJECT, type=mujoco.mjtGeom.mjGEOM_MESH, meshname=OBJECT, rgba=rgba)


def method_color(name: str, place: int) -> Color:
    """A method's colour, as everywhere; ``place`` counts those that have none of their own."""
    return of_palette(palette.OF_METHODS.get(name) or palette.OTHERS[place % len(palette.OTHERS)])


def _added(
    scene: mujoco.MjvScene, kind: mujoco.mjtGeom, rgba: tuple[float, float, float, float]
) -> mujoco.MjvGeom:
    """One more geom in a scene."""
    geom = scene.geoms[scene.ngeom]
    scene.ngeom += 1
    size, pos, mat = np.ones(3), np.zeros(3), np.eye(3).ravel()
    mujoco.mjv_initGeom(geom, kind, size, pos, mat, np.array(rgba, dtype=np.float32))
    return geom


def _links_of_pads(model: mujoco.MjModel, pads: Sequence[int]) -> list[list[int]]:
    """For each pad the geoms of its link, if it is the link's only pad."""
    bodies = model.geom_bodyid[list(pads)]
    links = []
    for body in bodies:
        alone = np.count_nonzero(bodies == body) == 1
        geoms = np.flatnonzero(model.geom_bodyid == body) if alone else np.empty(0, dtype=int)
        links.append([g for g in geoms.tolist() if g not in pads])
    return links


def _corners(model: mujoco.MjModel, data: mujoco.MjData, geom: int) -> np.ndarray:
    """Corners of the box around a geom in its own frame, in the world [m], shape (8, 3)."""
    center, half = model.geom_aabb[geom, :3], model.geom_aabb[geom, 3:]
    signs = np.array(list(itertools.product((-1, 1), repeat=3)))
    R_wg = data.geom_xmat[geom].reshape(3, 3)
    return np.asarray(data.geom_xpos[geom] + (center + signs * half) @ R_wg.T)
