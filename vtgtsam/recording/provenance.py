# SPDX-License-Identifier: MIT
"""The hand and the object inside a recording: attachments, and metadata that says what they are.

The object's mesh is attached in its own frame and unit, as it came; ``object_scale`` and
``object_origin`` say how it becomes object coordinates: p_o = scale * p_mesh - origin.
"""

from __future__ import annotations

import dataclasses
import json
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

from ..atomic import naming
from ..exceptions import HandError, MeshError, RecordingError
from ..input.door import reading
from ..input.plain import plain
from ..input.text import parse_json
from . import names

if TYPE_CHECKING:
    import trimesh

    from ..hands.model import HandModel
    from ..objects import ObjectModel


RESOLUTION = 128  # of an object's field where a recording says nothing
ATTACHED_MESHES = (".obj", ".ply", ".stl", ".off", ".glb")  # formats that need no other file


def object_metadata(obj: ObjectModel) -> dict[str, str]:
    """Metadata entries that describe an object."""
    entries = {
        "object": obj.name,
        "object_sha256": obj.sha256 or "",
        "object_scale": repr(obj.scale),
        "object_origin": " ".join(repr(float(x)) for x in obj.origin),
    }
    nodes = len(obj.sdf.values)
    if nodes != RESOLUTION:
        entries["object_resolution"] = str(nodes)
    if obj.symmetry is not None:
        entries["object_symmetry"] = json.dumps(obj.symmetry, sort_keys=True)
    return entries


def mesh_file(obj: ObjectModel) -> bytes:
    """The object's mesh in its own frame and unit, as an OBJ file that keeps every bit.

    Raises:
        ValueError: The object has no mesh.
    """
    if obj.mesh is None:
        raise ValueError(f"object {obj.name!r} has no mesh to attach; give it one")
    mesh = _source_mesh(obj)
    lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in mesh.vertices.tolist()]
    lines += [f"f {a + 1} {b + 1} {c + 1}" for a, b, c in mesh.faces.tolist()]
    return ("\n".join(lines) + "\n").encode()


def _source_mesh(obj: ObjectModel) -> trimesh.Trimesh:
    from ..mesh.reading import read_mesh
    from ..shapes import CATALOGUE

    if obj.source is None or (obj.scale == 1.0 and not any(obj.origin)):
        return obj.mesh
    shape = CATALOGUE.get(obj.source)
    return read_mesh(obj.source) if shape is None else shape.mesh()


def find_hand(info: Mapping[str, str], attachments: Mapping[str, bytes]) -> HandModel:
    """The hand a recording was made with, from its attachment or else by its name.

    Raises:
        RecordingError: The recording says nothing of its hand.
        HandError: The attachment is no hand, or the name is unknown.
    """
    from ..hands.model import HandModel, built_in_hands, load_hand

    attached = _attached(attachments, names.HAND_ATTACHMENT)
    if attached is not None:
        with reading("the hand attached to the recording", HandError):
            return HandModel.from_text(attached[1].decode())
    if not info.get("hand"):
        raise RecordingError(
            "the recording does not say which hand it was made with; "
            "give hand= (--hand), a name or an MJCF or URDF file"
        )
    if info["hand"] not in built_in_hands():
        _refuse_path("hand", info["hand"])
    return load_hand(info["hand"])


def find_object(info: Mapping[str, str], attachments: Mapping[str, bytes]) -> ObjectModel:
    """The object in a recording, from its attached mesh or else by its name.

    Raises:
        RecordingError: The recording says nothing of its object, or something unreadable.
        MeshError: The attachment is no mesh, or the name is unknown.
    """
    from ..objects import load_object
    from ..shapes import CATALOGUE

    attached = _attached(attachments, names.OBJECT_ATTACHMENT)
    if attached is None and not info.get("object"):
        raise RecordingError(
            "the recording does not say which object it shows; "
            "give object= (--object), a name or a mesh file"
        )
    scale, origin = _number(info, "object_scale", 1.0), _origin(info)
    resolution = int(_number(info, "object_resolution", RESOLUTION))
    if attached is None:
        if info["object"] not in CATALOGUE:
            _refuse_path("object", info["object"])
        return load_object(info["object"], scale=scale, origin=origin, resolution=resolution)
    suffix, data = attached
    if suffix.lower() not in ATTACHED_MESHES:
        raise RecordingError(
            f"the object's mesh is attached as {plain(suffix) or 'a file without a suffix'}, expected one of "
            f"{', '.join(ATTACHED_MESHES)}; give the object with object= (--object)"
        )
    with tempfile.TemporaryDirectory() as folder, reading("the attached mesh", MeshError):
        file = Path(folder) / f"{names.OBJECT_ATTACHMENT}{suffix.lower()}"
        with naming(file):
            file.write_bytes(data)
        obj = load_object(file, scale=scale, origin=origin, resolution=resolution)
    name = plain(Path(info.get("object", "") or names.OBJECT_ATTACHMENT).stem, 80)
    return dataclasses.replace(obj, name=name, symmetry=_symmetry(info), source=None)


def _refuse_path(what: str, name: str) -> None:
    """What a recording says opens no file of this machine: it may name what is built in, and attach the rest."""
    if Path(name).name != name or Path(name).exists():
        raise RecordingError(
            f"the recording names its {what} {plain(repr(name))}, which is not built in, and does not hold it; "
            f"give it with {what}= (--{what})"
        )


def _symmetry(info: Mapping[str, str]) -> dict[str, Any] | None:
    from ..mesh.symmetry import read_symmetry

    if "object_symmetry" not in info:
        return None
    what = "metadata 'object_symmetry'"
    symmetry = parse_json(info["object_symmetry"], what, RecordingError)
    if symmetry is not None and not isinstance(symmetry, dict):
        raise RecordingError(f"{what} must be an object's entry of BOP's models_info.json")
    try:
        return None if symmetry is None else read_symmetry(symmetry)
    except MeshError as error:
        raise RecordingError(f"{what}: {error}") from None


def _attached(attachments: Mapping[str, bytes], stem: str) -> tuple[str, bytes] | None:
    """Suffix and content of the attachment of that name, whatever its suffix."""
    for name, data in attachments.items():
        if Path(name).stem == stem:
            return Path(name).suffix, data
    return None


def _number(info: Mapping[str, str], key: str, default: float) -> float:
    try:
        return float(info.get(key) or default)
    except ValueError:
        raise RecordingError(
            f"metadata {key!r} must be a number, got {plain(repr(info[key]))}"
        ) from None


def _origin(info: Mapping[str, str]) -> tuple[float, ...] | None:
    text = info.get("object_origin", "")
    try:
        numbers = tuple(float(word) for word in text.replace(",", " ").strip("()[] ").split())
    except ValueError:
        numbers = ()
    if text.strip() and len(numbers) != 3:
        raise RecordingError(
            f"metadata 'object_origin' must be three numbers [m], got {plain(repr(text))}"
        )
    return numbers or None
