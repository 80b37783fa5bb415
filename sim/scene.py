# SPDX-License-Identifier: MIT
"""The MuJoCo scene: a hand on a turning wrist, an object above its palm, a camera.

``build`` returns the model and does nothing else. The hand's own file is extended, not repeated: motors
and the pads' contact geometry are added to its specification. The world frame w has the hand's origin as
its own, the palm up (+z) and the fingers along +x until the wrist turns.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import mujoco
import numpy as np

from vtgtsam import HandModel, ObjectModel
from vtgtsam.grasp import GraspDescription
from vtgtsam.hands.file import PADS_TEXT, compile_hand, parse_spec, read_spec
from vtgtsam.hands.pad_boxes import PadBox
from vtgtsam.hands.pads import RIM
from vtgtsam.hands.shapes import SHOWN_GROUPS
from vtgtsam.objects import mesh_of

from . import constants as c
from .appearance import color_of
from .convex import convex_parts
from .skin import Skin, find_skin

if TYPE_CHECKING:
    import trimesh

WRIST, OBJECT, CAMERA = "wrist", "object", "camera"
HAND = "hand/"  # begins the name of everything that comes from the hand's file
VISIBLE, CONTACT_ONLY, HIDDEN = 1, 3, 4  # groups; MuJoCo and the camera show 0-2
# Every geom of the hand that touches anything touches the object, whatever bits its author chose; pads
# have a bit of their own and touch nothing else.
_OBJECT_BITS, _PAD_BIT = 0x7FFFFFFF, 1 << 30


def build(
    description: GraspDescription, hand: HandModel, obj: ObjectModel, friction: str = "paper"
) -> mujoco.MjModel:
    """The scene as a compiled model; the object stands at the world's origin until it is placed.

    Args:
        description: How the hand grasps.
        hand: The hand.
        obj: The object.
        friction: One of ``constants.FRICTION``.

    Raises:
        HandError: The description names joints that the hand does not have.
    """
    description.check(hand)
    scene = mujoco.MjSpec()
    scene.modelname = f"{hand.name} and {obj.name}"
    _set_physics(scene)
    scene.option.impratio = c.FRICTION[friction]
    _light(scene)
    _add_hand(scene, description, hand)
    _add_object(scene, obj)
    _add_camera(scene, description)
    return scene.compile()


def build_hand(description: GraspDescription, hand: HandModel) -> mujoco.MjModel:
    """A hand alone on its wrist, as a compiled model, whose pads touch each other.

    Raises:
        HandError: The description names joints that the hand does not have.
    """
    description.check(hand)
    scene = mujoco.MjSpec()
    scene.modelname = f"{hand.name} alone"
    _set_physics(scene)
    _add_hand(scene, description, hand)
    model = scene.compile()
    pads = [model.geom(pad_geom(name)).id for name in hand.pad_names]
    model.geom_contype[pads] = model.geom_conaffinity[pads] = _PAD_BIT
    return model


def _set_physics(scene: mujoco.MjSpec) -> None:
    scene.option.timestep = c.TIME_STEP
    scene.option.cone = mujoco.mjtCone.mjCONE_ELLIPTIC
    scene.option.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    scene.compiler.boundmass, scene.compiler.boundinertia = 1e-6, 1e-9  # links without mass
    scene.compiler.balanceinertia = True


def _light(scene: mujoco.MjSpec) -> None:
    scene.visual.headlight.ambient = (0.35, 0.35, 0.35)
    scene.visual.headlight.diffuse = (0.35, 0.35, 0.35)
    scene.visual.global_.offwidth, scene.visual.global_.offheight = 1280, 960
    scene.add_texture(
        name="surroundings",  # what colour images show where nothing is
        type=mujoco.mjtTexture.mjTEXTURE_SKYBOX,
        builtin=mujoco.mjtBuiltin.mjBUILTIN_GRADIENT,
        rgb1=(0.75, 0.78, 0.80),
        rgb2=(0.45, 0.47, 0.50),
        width=64,
        height=64,
    )
    scene.visual.quality.shadowsize = 1024
    light = scene.worldbody.add_light(pos=(0.5, -0.4, 1.2), dir=(-0.4, 0.4, -1.1), castshadow=True)
    light.diffuse, light.cutoff = (0.45, 0.45, 0.45), 30.0


def _add_hand(scene: mujoco.MjSpec, description: GraspDescription, hand: HandModel) -> None:
    wrist = scene.worldbody.add_body(name=WRIST, quat=_quat(description.palm.level()))
    across = np.cross(description.palm.normal, description.palm.fingers)
    wrist.add_joint(
        name=WRIST, axis=-across, armature=c.WRIST_ARMATURE
    )  # a positive angle lifts the fingers
    _add_servo(scene, WRIST, c.WRIST_GAIN, c.WRIST_DAMPING, np.inf)
    if description.forearm is not None:
        ends = [*description.forearm.start, *description.forearm.end]
        wrist.add_geom(
            type=mujoco.mjtGeom.mjGEOM_CYLINDER,
            fromto=ends,
            size=(description.forearm.radius, 0, 0),
            rgba=(0.2, 0.2, 0.22, 1),
            contype=0,
            conaffinity=0,
        )
    spec = hand_with_pads(hand)
    take_options(spec, scene)
    scene.attach(spec, prefix=HAND, frame=wrist.add_frame())
    _add_motors(scene, description, hand)


def hand_with_pads(hand: HandModel) -> mujoco.MjSpec:
    """The hand's specification with contact geometry for its pads, without motors of its own."""
    spec = read_spec(hand.source) if hand.source else parse_spec(hand.xml)
    compile_hand(spec)  # leaves out meshes that are missing
    for part in [*spec.actuators, *spec.keys, *spec.sensors, *spec.cameras, *spec.lights]:
        spec.delete(part)
    for text in [text for text in spec.texts if text.name == PADS_TEXT]:
        spec.delete(text)
    for box in hand.pad_boxes:
        if box.element is not None:
            _hide(spec.body(hand.model.body(box.body).name), box.element)
    _show_something(spec)
    neutral = mujoco.MjSpec().default  # what the hand's file has as defaults is not for these
    for box in hand.pad_boxes:
        _add_pad(spec, spec.body(hand.model.body(box.body).name), box, neutral)
    return spec


def take_options(spec: mujoco.MjSpec, scene: mujoco.MjSpec) -> None:
    """Give a hand the scene's options, which count anyway: MuJoCo warns where they differ."""
    for name in dir(scene.option):
        if not name.startswith("_"):
            setattr(spec.option, name, getattr(scene.option, name))


def _show_something(spec: mujoco.MjSpec) -> None:
    """Where a hand came without its meshes, let cameras see what it collides with."""
    left = [geom for geom in spec.geoms if geom.group != HIDDEN]
    if all(geom.group >= SHOWN_GROUPS for geom in left):
        for geom in left:
            geom.group = VISIBLE


def _hide(body: mujoco.MjsBody, name: str) -> None:
    """Hide the box by which the hand's file describes a pad; the pad's own geometry replaces it."""
    for site in body.sites:
        if site.name == name:
            site.group = HIDDEN
    for geom in body.geoms:
        if (geom.name or body.name) == name:
            geom.group = HIDDEN
            geom.contype = geom.conaffinity = 0


def _add_pad(
    spec: mujoco.MjSpec, body: mujoco.MjsBody, box: PadBox, default: mujoco.MjsDefault
) -> None:
    name = f"{box.name} contact"
    _add_hull(spec, name, rounded_box(box.size), default=default)
    body.add_geom(
        default=default,
        name=name,
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=name,
        pos=box.T_bp[:3, 3],
        quat=_quat(box.T_bp[:3, :3]),
        mass=0,
        contype=0,
        conaffinity=_PAD_BIT,
        group=VISIBLE,
        rgba=(0.22, 0.26, 0.32, 1),
    )


def rounded_box(size: np.ndarray) -> np.ndarray:
    """Corners of a pad, shape (N, 3) [m] in the pad frame: a box with its upper edges rounded.

    The contact face thus ends where the grid of points that the estimator knows ends (paper: "the round
    sensor pad edges with a radius of 2 mm are excluded"). ``size`` has the box's lengths [m], shape (3,).
    """
    angles = np.linspace(0.0, np.pi / 2, 5)
    inset = np.append(RIM * (1 - np.sin(angles)), 0.0)
    height = np.append(-RIM * (1 - np.cos(angles)), -max(size[2], 1.5 * RIM))
    half = size[:2] / 2 - inset[:, None]
    signs = np.array([(1, 1), (1, -1), (-1, 1), (-1, -1)])
    corners = half[:, None, :] * signs
    return np.concatenate([corners, np.repeat(height, 4).reshape(-1, 4, 1)], axis=2).reshape(-1, 3)


def pad_geom(pad_name: str) -> str:
    """Name of the geom that stands for a pad in the scene."""
    return f"{HAND}{pad_name} contact"


def _add_motors(scene: mujoco.MjSpec, description: GraspDescription, hand: HandModel) -> None:
    ranks = description.ranks()
    for name in hand.joint_names:
        joint = scene.joint(HAND + name)
        joint.armature = c.ARMATURE
        joint.damping = np.array([c.JOINT_DAMPING, 0.0, 0.0])
        if name not in hand.coupled_joints:
            rank = ranks.get(name)
            gain, damping = (c.HOLD_GAIN, c.HOLD_DAMPING) if rank is None else _gains(rank)
            _add_servo(scene, joint.name, gain, damping, c.STALL_TORQUE)


def _gains(rank: int) -> tuple[float, float]:
    rank = min(rank, len(c.GAINS) - 1)
    return c.GAINS[rank], c.DAMPINGS[rank]


def _add_servo(
    scene: mujoco.MjSpec, joint: str, gain: float, damping: float, max_torque: float
) -> None:
    servo = scene.add_actuator(name=joint, target=joint, trntype=mujoco.mjtTrn.mjTRN_JOINT)
    servo.set_to_position(kp=gain, kv=damping)
    if np.isfinite(max_torque):
        servo.forcelimited = True
        servo.forcerange = (-max_torque, max_torque)


def _add_object(scene: mujoco.MjSpec, obj: ObjectModel) -> None:
    body = scene.worldbody.add_body(name=OBJECT)
    body.add_freejoint(name=OBJECT)
    _set_inertia(body, obj)
    _add_surface(scene, body, obj)
    for index, vertices in enumerate(convex_parts(obj.mesh)):
        name = f"{OBJECT} part {index}"
        _add_hull(scene, name, vertices)
        body.add_geom(
            name=name,
            type=mujoco.mjtGeom.mjGEOM_MESH,
            meshname=name,
            contype=_OBJECT_BITS,
            conaffinity=_OBJECT_BITS,
            mass=0,
            group=CONTACT_ONLY,
            priority=1,  # its contact parameters count, not the hand's
            solref=c.SOLREF,
            solimp=c.SOLIMP,
        )


def _add_surface(scene: mujoco.MjSpec, body: mujoco.MjsBody, obj: ObjectModel) -> None:
    """Add what cameras see of the object, in the colours of its file where that has a texture."""
    skin = find_skin(obj)
    surface: Skin | trimesh.Trimesh = obj.mesh if skin is None else skin
    mesh = scene.add_mesh(
        name=OBJECT,
        uservert=np.asarray(surface.vertices, dtype=np.float64).ravel(),
        userface=np.asarray(surface.faces, dtype=np.int32).ravel(),
        inertia=mujoco.mjtMeshInertia.mjMESH_INERTIA_SHELL,  # not used; an open mesh fails otherwise
    )
    geom = body.add_geom(
        name=OBJECT,
        type=mujoco.mjtGeom.mjGEOM_MESH,
        meshname=OBJECT,
        contype=0,
        conaffinity=0,
        mass=0,
        group=VISIBLE,
        rgba=(*color_of(obj.name), 1),
    )
    if skin is not None:
        mesh.usertexcoord = skin.coordinates.ravel()
        mesh.userfacetexcoord = np.asarray(skin.faces, dtype=np.int32).ravel()
        _paint(scene, geom, skin.image)


def _paint(scene: mujoco.MjSpec, geom: mujoco.MjsGeom, image: np.ndarray) -> None:
    texture = scene.add_texture(name=OBJECT, type=mujoco.mjtTexture.mjTEXTURE_2D, nchannel=3)
    texture.height, texture.width = image.shape[:2]
    texture.data = image.tobytes()
    material = scene.add_material(name=OBJECT, rgba=(1, 1, 1, 1))
    material.textures[mujoco.mjtTextureRole.mjTEXROLE_RGB] = OBJECT
    geom.material, geom.rgba = OBJECT, (1, 1, 1, 1)


def _add_hull(spec: mujoco.MjSpec, name: str, vertices: np.ndarray, **options: Any) -> None:
    """Add the convex hull of points, shape (N, 3) [m], as a mesh."""
    spec.add_mesh(name=name, uservert=np.asarray(vertices, dtype=np.float64).ravel(), **options)


def _set_inertia(body: mujoco.MjsBody, obj: ObjectModel) -> None:
    """Mass and inertia of a body of even density."""
    mesh = mesh_of(obj)
    solid: trimesh.Trimesh = mesh if mesh.is_volume else mesh.convex_hull
    mass = obj.mass if obj.mass is not None else min(c.DENSITY * solid.volume, c.MAX_MASS)
    inertia = solid.moment_inertia * mass / solid.volume
    body.explicitinertial = True
    body.mass = mass
    body.ipos = solid.center_mass
    xx, yy, zz = np.diag(inertia)
    body.fullinertia = (xx, yy, zz, inertia[0, 1], inertia[0, 2], inertia[1, 2])


def _add_camera(scene: mujoco.MjSpec, description: GraspDescription) -> None:
    """A camera that looks at the palm from where the paper has it."""
    target = description.palm.level() @ description.palm.center
    position = target + (c.CAMERA_DISTANCE, 0.0, c.CAMERA_HEIGHT)
    back = (position - target) / np.linalg.norm(position - target)
    right = np.cross((0.0, 0.0, 1.0), back)
    right /= np.linalg.norm(right)
    # MuJoCo's cameras look along -z with y up.
    rotation = np.column_stack([right, np.cross(back, right), back])
    scene.worldbody.add_camera(name=CAMERA, pos=position, quat=_quat(rotation), fovy=c.CAMERA_FOVY)


def _quat(R: np.ndarray) -> np.ndarray:
    quat_wxyz = np.empty(4)
    mujoco.mju_mat2Quat(quat_wxyz, np.asarray(R, dtype=np.float64).ravel())
    return quat_wxyz
