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
from typing import TYPE_CHECKING

from ..exceptions import RecordingError
from . import names

if TYPE_CHECKING:
    import trimesh

    from ..hands.model import HandModel
    from ..objects import ObjectModel


def object_metadata(obj: ObjectModel) -> dict[str, str]:
    """Metadata entries that describe an object."""
    entries = {
        "object": obj.name,
        "object_sha256": obj.sha256 or "",
        "object_scale": repr(obj.scale),
        "object_origin": " ".join(repr(float(x)) for x in obj.origin),
    }
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
    from ..hands.model import HandModel, load_hand

    attached = _attached(attachments, names.HAND_ATTACHMENT)
    if attached is not None:
        return HandModel.from_text(attached[1].decode())
    if not info.get("hand"):
        raise RecordingError(
            "the recording does not say which hand it was made with; "
            "give hand= (--hand), a name or an MJCF or URDF file"
        )
    return load_hand(info["hand"])


def find_object(info: Mapping[str, str], attachments: Mapping[str, bytes]) -> ObjectModel:
    """The object in a recording, from its attached mesh or else by its name.

    Raises:
        RecordingError: The recording says nothing of its object, or something unreadable.
        MeshError: The attachment is no mesh, or the name is unknown.
    """
    from ..objects import load_object

    attached = _attached(attachments, names.OBJECT_ATTACHMENT)
    if attached is None and not info.get("object"):
        raise RecordingError(
            "the recording does not say which object it shows; "
            "give object= (--object), a name or a mesh file"
        )
    scale, origin = _number(info, "object_scale", 1.0), _origin(info)
    if attached is None:
        return load_object(info["object"], scale=scale, origin=origin)
    suffix, data = attached
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / f"{names.OBJECT_ATTACHMENT}{suffix}"
        file.write_bytes(data)
        obj = load_object(file, scale=scale, origin=origin)
    symmetry = json.loads(info["object_symmetry"]) if "object_symmetry" in info else None
    name = Path(info.get("object", "") or names.OBJECT_ATTACHMENT).stem
    return dataclasses.replace(obj, name=name, symmetry=symmetry, source=None)


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
        raise RecordingError(f"metadata {key!r} must be a number, got {info[key]!r}") from None


def _origin(info: Mapping[str, str]) -> tuple[float, ...] | None:
    text = info.get("object_origin", "")
    try:
        numbers = tuple(float(word) for word in text.replace(",", " ").strip("()[] ").split())
    except ValueError:
        numbers = ()
    if text.strip() and len(numbers) != 3:
        raise RecordingError(f"metadata 'object_origin' must be three numbers [m], got {text!r}")
    return numbers or None
