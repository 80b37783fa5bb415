# SPDX-License-Identifier: MIT
"""Reading a hand's description, MJCF or URDF, into a MuJoCo model and the boxes that are pads."""

from __future__ import annotations

import logging
import re
from dataclasses import dataclass
from fnmatch import fnmatchcase
from pathlib import Path

import mujoco
import numpy as np

from ..exceptions import HandError

_log = logging.getLogger(__name__)

_UNNAMED = "body "  # a body without a name gets this and its number
PADS_TEXT = "vtgtsam_pads"  # name of the <text> in <custom> that keeps which boxes are pads


@dataclass(frozen=True)
class PadBox:
    """A pad as the file has it: a box fixed to a body b.

    Attributes:
        name: The pad's name.
        size: Length of the box along its x, y and z [m], shape (3,).
        body: Id of the body b in the model.
        T_bp: Pose of the pad frame, origin at the centre of the box's +z face, shape (4, 4).
    """

    name: str
    size: np.ndarray
    body: int
    T_bp: np.ndarray


def read_spec(path: Path) -> mujoco.MjSpec:
    """The hand's description as an editable MuJoCo specification.

    Raises:
        HandError: The file does not exist or is neither MJCF nor URDF.
    """
    if not path.is_file():
        raise HandError(f"no hand description at {path}")
    try:
        return _keep_links(mujoco.MjSpec.from_file(str(path)))
    except ValueError as error:
        raise HandError(_why_unread(str(path), error)) from error


def parse_spec(text: str) -> mujoco.MjSpec:
    """As ``read_spec``, from the text of an MJCF file that needs no other file.

    Raises:
        HandError: The text is neither MJCF nor URDF.
    """
    try:
        return _keep_links(mujoco.MjSpec.from_string(text))
    except ValueError as error:
        raise HandError(_why_unread("the text", error)) from error


def _why_unread(what: str, error: Exception) -> str:
    if line := re.search(
        r"XML_ERROR_.*Line number=(\d+)", str(error)
    ):  # of TinyXML-2, not of MuJoCo
        return (
            f"{what}, line {line[1]}: not valid XML; look for a tag or a quote that is not closed"
        )
    return f"{what} is neither MJCF nor URDF: {_one_line(error)}"


def _keep_links(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    # Set for URDF, where it would merge a pad's own link into its parent and lose its name.
    spec.compiler.fusestatic = False
    # A link without mass stops the compiler, though kinematics needs none.
    spec.compiler.boundmass = max(spec.compiler.boundmass, 1e-6)
    spec.compiler.boundinertia = max(spec.compiler.boundinertia, 1e-9)
    spec.compiler.balanceinertia = True
    for index, body in enumerate(spec.bodies):
        body.name = body.name or f"{_UNNAMED}{index}"
    return spec


def compile_hand(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Compile a hand; where its meshes or textures are missing, without them.

    Raises:
        HandError: The description is wrong, a joint has no name, or a joint is free or a ball.
    """
    try:
        model = spec.compile()
    except ValueError as error:
        if not _needs_files(spec):
            raise HandError(f"MuJoCo cannot use this hand: {_one_line(error)}") from error
        model = _compile_without_files(spec, error)
    _check_joints(model)
    return model


def _compile_without_files(spec: mujoco.MjSpec, error: Exception) -> mujoco.MjModel:
    remove_files(spec)
    try:
        model = spec.compile()
    except ValueError as second:
        raise HandError(f"MuJoCo cannot use this hand: {_one_line(second)}") from second
    _log.warning("hand loaded without its meshes, only joints and boxes: %s", _one_line(error))
    return model


def _needs_files(spec: mujoco.MjSpec) -> bool:
    return bool(spec.meshes or spec.textures or spec.hfields or spec.skins)


def remove_files(spec: mujoco.MjSpec) -> None:
    """Remove what lies in other files (meshes, textures); joints and boxes stay."""
    for geom in list(spec.geoms):
        if geom.type in (mujoco.mjtGeom.mjGEOM_MESH, mujoco.mjtGeom.mjGEOM_HFIELD):
            spec.delete(geom)
    for asset in [*spec.meshes, *spec.hfields, *spec.skins]:
        spec.delete(asset)
    for texture in spec.textures:  # materials may refer to it, so it stays, in one colour
        texture.file = ""
        texture.builtin = mujoco.mjtBuiltin.mjBUILTIN_FLAT
        texture.width = texture.height = 8


def _check_joints(model: mujoco.MjModel) -> None:
    for index in range(model.njnt):
        joint = model.joint(index)
        body = model.body(model.jnt_bodyid[index]).name
        if model.jnt_type[index] == mujoco.mjtJoint.mjJNT_FREE:
            raise HandError(
                f"body {body!r} has a free joint; remove it from the hand's file, "
                "since T_wh says where the hand is"
            )
        if model.jnt_type[index] == mujoco.mjtJoint.mjJNT_BALL:
            raise HandError(f"joint {joint.name!r} is a ball joint; use hinges instead")
        if not joint.name:
            raise HandError(f"a joint of body {body!r} has no name; give it one")


def self_contained(path: Path, spec: mujoco.MjSpec, pads: str) -> str:
    """The hand as MJCF text that needs no other file, for an attachment.

    The file's own text where that is enough, else what MuJoCo writes, without meshes.
    """
    text = path.read_text()
    own = "<mujoco" in text and "<include" not in text and not _needs_files(spec)
    if own and pads == "pad_*":
        return text
    spec = spec.copy()
    remove_files(spec)
    if not any(entry.name == PADS_TEXT for entry in spec.texts):
        spec.add_text(name=PADS_TEXT, data=pads)
    spec.compile()
    return str(spec.to_xml())


def pads_pattern(spec: mujoco.MjSpec) -> str | None:
    """Which boxes are pads, where the description itself says so."""
    return next((entry.data for entry in spec.texts if entry.name == PADS_TEXT), None)


def find_pads(model: mujoco.MjModel, pattern: str) -> list[PadBox]:
    """The pads of a hand: box sites whose name matches, or else box geoms.

    A box geom without a name (usual in URDF) goes by the name of its body.

    Raises:
        HandError: Nothing matches, or what matches is not a box.
    """
    sites = [_Shape(model.site(i), model.site_bodyid[i], model) for i in range(model.nsite)]
    geoms = [_Shape(model.geom(i), model.geom_bodyid[i], model) for i in range(model.ngeom)]
    matching = [site for site in sites if fnmatchcase(site.own_name, pattern)]
    round_ones = [site.own_name for site in matching if not site.is_box]
    if round_ones:
        raise HandError(f'pad sites must be boxes (type="box"), not so: {", ".join(round_ones)}')
    if not matching:
        matching = [geom for geom in geoms if geom.is_box and fnmatchcase(geom.name, pattern)]
    if not matching:
        raise HandError(_no_pads([*sites, *geoms], pattern))
    return [shape.pad() for shape in matching]


def _no_pads(shapes: list[_Shape], pattern: str) -> str:
    boxes = {shape.name for shape in shapes if shape.is_box and shape.name}
    named = sorted(name for name in boxes if not name.startswith(_UNNAMED))
    return (
        f"no box site or box geom is named {pattern!r}; boxes in the file: "
        f"{', '.join(named) or 'none with a name'}. Name the pads' box sites pad_*, or say in a topic map "
        'which boxes are pads, like pads: "taxel_*"; docs/pads.md shows how'
    )


class _Shape:
    """A site or geom of the compiled model."""

    def __init__(self, view: object, body: int, model: mujoco.MjModel) -> None:
        self.own_name: str = view.name  # type: ignore[attr-defined]
        self.name = self.own_name or str(model.body(body).name)
        self.is_box = view.type[0] == mujoco.mjtGeom.mjGEOM_BOX  # type: ignore[attr-defined]
        self._body = int(body)
        self._view = view

    def pad(self) -> PadBox:
        half = np.array(self._view.size)  # type: ignore[attr-defined]
        rotation = np.empty(9)
        mujoco.mju_quat2Mat(rotation, self._view.quat)  # type: ignore[attr-defined]
        T_bp = np.eye(4)
        T_bp[:3, :3] = rotation.reshape(3, 3)
        T_bp[:3, 3] = self._view.pos + half[2] * T_bp[:3, 2]  # type: ignore[attr-defined]
        return PadBox(self.name, 2 * half, self._body, T_bp)


def _one_line(error: Exception) -> str:
    return " ".join(str(error).removeprefix("Error:").removeprefix("XML Error:").split())
