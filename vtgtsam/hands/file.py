# SPDX-License-Identifier: MIT
"""Reading a hand's description, MJCF or URDF, into a MuJoCo specification and a compiled model."""

from __future__ import annotations

import logging
import re
from pathlib import Path

import mujoco
import numpy as np

from ..exceptions import HandError
from . import mesh_files
from .xml_check import check_file, check_text

_log = logging.getLogger(__name__)

UNNAMED = "body "  # a body without a name gets this and its number
PADS_TEXT = "vtgtsam_pads"  # name of the <text> in <custom> that keeps which boxes are pads
_PLACES = (
    "body_pos",
    "body_quat",
    "jnt_pos",
    "jnt_axis",
    "site_pos",
    "site_quat",
    "geom_pos",
    "geom_quat",
    "qpos0",
)
_FAR = 1e4  # also in radians and as part of a quaternion
_DECLARATION = "XML_ERROR_PARSING_DECLARATION"


def read_spec(path: Path) -> mujoco.MjSpec:
    """The hand's description as an editable MuJoCo specification.

    Raises:
        HandError: The file does not exist or is neither MJCF nor URDF.
    """
    if not path.is_file():
        raise HandError(f"no hand description at {path}")
    text = path.read_bytes().decode("utf-8", errors="replace")
    if "<xacro:" in text:
        stem = path.name.partition(".")[0]
        expanded = f"{stem}.urdf" if path.name != f"{stem}.urdf" else f"{stem}_expanded.urdf"
        raise HandError(
            f"{path} is a xacro file, which has to be expanded first: xacro {path.name} > {expanded}"
        )
    if "<mujoco" not in text and "<robot" not in text:
        raise HandError(
            f"{path} is neither MJCF (its root would be <mujoco>) nor URDF (<robot>); "
            "export the hand in one of these"
        )
    if path.suffix.lower() not in (".xml", ".urdf"):
        suffix = ".xml" if "<mujoco" in text else ".urdf"
        raise HandError(
            f"MuJoCo does not read files that end in {path.suffix or 'nothing'}; rename {path} to "
            f"{path.stem}{suffix}"
        )
    check_file(path)
    try:
        if "<robot" in text and "<collision" not in text and "<mujoco" not in text:
            return _keep_links(_with_visuals(path, text))
        return _keep_links(mujoco.MjSpec.from_file(str(path)))
    except ValueError as error:
        raise HandError(_why_unread(str(path), error)) from error


def _with_visuals(path: Path, urdf: str) -> mujoco.MjSpec:
    """A URDF whose links have nothing but what they look like, which MuJoCo would leave out."""
    keep = '<mujoco><compiler discardvisual="false" strippath="false"/></mujoco>'
    spec = mujoco.MjSpec.from_string(re.sub(r"(<robot\b[^>]*>)", rf"\1{keep}", urdf, count=1))
    spec.modelfiledir = str(path.parent)
    return spec


def parse_spec(text: str) -> mujoco.MjSpec:
    """As ``read_spec``, from the text of an MJCF file that needs no other file.

    Raises:
        HandError: The text is neither MJCF nor URDF.
    """
    check_text(text, "the hand's text")
    try:
        return _keep_links(mujoco.MjSpec.from_string(text))
    except ValueError as error:
        raise HandError(_why_unread("the text", error)) from error


def _why_unread(what: str, error: Exception) -> str:
    message = str(error)
    # XML_ERROR_ is said by TinyXML-2, the rest by MuJoCo.
    if line := re.search(r"XML_ERROR_.*Line number=(\d+)", message):
        if _DECLARATION in message:
            return f"{what}, line {line[1]}: something stands before <?xml ... ?>, which must come first; remove it"
        return (
            f"{what}, line {line[1]}: not valid XML; look for a tag or a quote that is not closed"
        )
    if "Schema violation" in message:
        return (
            f"{what} does not say what MuJoCo {mujoco.__version__} understands: {_one_line(error)}; a "
            "file for another version of MuJoCo has to be brought up to date"
        )
    if "mujocoinclude" in message:
        return f"{what} is a part that other files include; give the file that includes it"
    if "Error opening file" in message:
        return f"{what} includes a file that is not there: {_one_line(error)}"
    return f"MuJoCo cannot read {what}: {_one_line(error)}"


def _keep_links(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    # Set for URDF, where it would merge a pad's own link into its parent and lose its name.
    spec.compiler.fusestatic = False
    # A link without mass stops the compiler, though kinematics needs none.
    spec.compiler.boundmass = max(spec.compiler.boundmass, 1e-6)
    spec.compiler.boundinertia = max(spec.compiler.boundinertia, 1e-9)
    spec.compiler.balanceinertia = True
    for index, body in enumerate(spec.bodies):
        body.name = body.name or f"{UNNAMED}{index}"
    return spec


def compile_hand(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """Compile a hand; meshes and textures that are missing or that MuJoCo cannot use are left out.

    Raises:
        HandError: The description is wrong, a joint has no name, or a joint is free or a ball.
    """
    if missing := mesh_files.settle(spec):
        _log.warning("hand loaded without %s", missing)
    model = None
    while model is None:
        try:
            model = spec.compile()
        except ValueError as error:
            left_out = mesh_files.spare(spec, error)
            if left_out:
                _log.warning("hand loaded without mesh %s: %s", left_out, _one_line(error))
            if left_out is not None:
                continue
            if not mesh_files.needed(spec):
                raise HandError(_unusable(error)) from error
            model = _compile_without_meshes(spec, error)
    _check_finite(model)
    _check_joints(model)
    return model


def _compile_without_meshes(spec: mujoco.MjSpec, error: Exception) -> mujoco.MjModel:
    mesh_files.remove_all(spec)
    try:
        model = spec.compile()
    except ValueError as second:
        raise HandError(_unusable(second)) from second
    _log.warning("hand loaded without its meshes, only joints and boxes: %s", _one_line(error))
    return model


def _unusable(error: Exception) -> str:
    """Why MuJoCo does not compile a hand, and what to do where that is known."""
    said = f"MuJoCo cannot use this hand: {_one_line(error)}"
    if "free joint can only be used" in said:
        said += "; make the floating joint fixed, since T_wh says where the hand is"
    return said


def _check_finite(model: mujoco.MjModel) -> None:
    """Refuse numbers that MuJoCo takes and no pose can be computed from."""
    for name in _PLACES:
        numbers = np.asarray(getattr(model, name))
        if not (np.abs(numbers) < _FAR).all():  # NaN is not
            raise HandError(
                f"the hand has a {name} that is not finite or beyond {_FAR:g} m; correct it in its file"
            )


def _check_joints(model: mujoco.MjModel) -> None:
    for index in range(model.njnt):
        joint = model.joint(index)
        body = model.body(model.jnt_bodyid[index]).name
        if model.jnt_type[index] == mujoco.mjtJoint.mjJNT_FREE:
            raise HandError(
                f"body {body!r} has a free joint; remove it from the hand's file (in URDF: make the "
                "floating joint fixed), since T_wh says where the hand is; of a scene give the hand's own file"
            )
        if model.jnt_type[index] == mujoco.mjtJoint.mjJNT_BALL:
            raise HandError(f"joint {joint.name!r} is a ball joint; use hinges instead")
        if not joint.name:
            raise HandError(f"a joint of body {body!r} has no name; give it one")


def self_contained(path: Path, spec: mujoco.MjSpec, pads: str) -> str:
    """The hand as MJCF text that needs no other file, for an attachment.

    The file's own text where that is enough, else what MuJoCo writes, without meshes.

    Args:
        path: The hand's file.
        spec: What was read from it.
        pads: Which boxes are pads: what ``pad_boxes.found`` takes.
    """
    text = path.read_bytes().decode("utf-8", errors="replace")
    elsewhere = ("<include", "<extension", "<plugin", "\ufffd")  # other files, libraries, not UTF-8
    own = "<mujoco" in text and not any(word in text for word in elsewhere)
    if own and pads == "pad_*" and not mesh_files.needed(spec):
        return text
    spec = spec.copy()
    mesh_files.remove_all(spec)
    for part in [*spec.actuators, *spec.sensors, *spec.keys]:  # may need a plugin, and no pad does
        spec.delete(part)
    for entry in [entry for entry in spec.texts if entry.name == PADS_TEXT]:
        spec.delete(entry)
    spec.add_text(name=PADS_TEXT, data=pads)
    spec.compile()
    return re.sub(r"<extension>.*?</extension>", "", spec.to_xml(), flags=re.DOTALL)


def pads_said(spec: mujoco.MjSpec) -> str | None:
    """Which boxes are pads, where the description itself says so."""
    return next((entry.data for entry in spec.texts if entry.name == PADS_TEXT), None)


def _one_line(error: Exception) -> str:
    return " ".join(str(error).removeprefix("Error:").removeprefix("XML Error:").split())
