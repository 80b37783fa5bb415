# SPDX-License-Identifier: MIT
"""The boxes of a hand's model that are pads: by their names, or as a pads file lists them."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

import mujoco
import numpy as np

from ..exceptions import HandError
from .file import UNNAMED
from .pad_file import PadEntry, entries_from_text, is_entries
from .pads import RIM

_log = logging.getLogger(__name__)
_NAMES_SHOWN = 12


@dataclass(frozen=True)
class PadBox:
    """A pad as the file has it: a box fixed to a body b.

    Attributes:
        name: The pad's name.
        size: Length of the box along its x, y and z [m], shape (3,).
        body: Id of the body b in the model.
        T_bp: Pose of the pad frame, origin at the centre of the box's +z face, shape (4, 4).
        element: Name of the site or geom that is the pad and nothing else; None for a pad of a pads
            file.
    """

    name: str
    size: np.ndarray
    body: int
    T_bp: np.ndarray
    element: str | None = None


def found(model: mujoco.MjModel, pads: str) -> list[PadBox]:
    """The pads of a hand.

    Args:
        model: The compiled hand.
        pads: A pattern of names, with the wildcards of file names; or a pads file's entries as
            ``pad_file.entries_text`` writes them.

    Raises:
        HandError: Nothing matches, or what matches is not a box.
    """
    if is_entries(pads):
        return listed(model, entries_from_text(pads))
    return named(model, pads)


def named(model: mujoco.MjModel, pattern: str) -> list[PadBox]:
    """The pads of a hand by name: box sites whose name matches, or else box geoms.

    A box geom without a name (usual in URDF) goes by the name of its body.

    Raises:
        HandError: Nothing matches, or what matches is not a box.
    """
    sites = [_Shape(model.site(i), model.site_bodyid[i], model) for i in range(model.nsite)]
    geoms = [_Shape(model.geom(i), model.geom_bodyid[i], model) for i in range(model.ngeom)]
    matching = [site for site in sites if fnmatchcase(site.own_name, pattern)]
    if round_ones := [site.own_name for site in matching if not site.is_box]:
        raise HandError(f'pad sites must be boxes (type="box"), not so: {", ".join(round_ones)}')
    others = [geom for geom in geoms if fnmatchcase(geom.own_name, pattern)]
    if matching and others:
        _log.warning(
            "box sites are the hand's pads; geoms of such names are none: %s. If they should be, make "
            "sites of them",
            ", ".join(geom.own_name for geom in others[:10]),
        )
    if not matching:
        matching = [geom for geom in geoms if fnmatchcase(geom.name, pattern)]
        matching = [geom for geom in matching if geom.is_box or geom.own_name]
    if round_ones := [geom.own_name for geom in matching if not geom.is_box]:
        raise HandError(
            f"pads must be boxes, these geoms (collisions in URDF) are not: {', '.join(round_ones)}; put "
            "a box there, or list the pads in a YAML file"
        )
    if not matching:
        raise HandError(_no_pads([*sites, *geoms], pattern))
    _check_unnamed(matching)
    boxes = [shape.pad() for shape in matching]
    for box in boxes:
        _check_upright(box)
    return boxes


def _check_upright(box: PadBox) -> None:
    """Refuse a box on edge: too thin along x or y for a face, where z is not the thin side."""
    thin = int(np.argmin(box.size))
    if box.size[thin] < 2 * RIM and box.size[2] > 1.5 * box.size[thin]:
        x, y, z = box.size * 1e3
        raise HandError(
            f"pad {box.name!r} is a box of {x:g} x {y:g} x {z:g} mm, thin along its {'xyz'[thin]} axis, but the "
            "face that touches is the one along +z; turn the box, or list the pad in a YAML file with "
            f"the face that touches, like face: +{'xyz'[thin]} (docs/pads.md)"
        )


def _check_unnamed(shapes: Sequence[_Shape]) -> None:
    unnamed = [shape.name for shape in shapes if not shape.own_name]
    for body in unnamed:
        if unnamed.count(body) > 1:
            raise HandError(
                f"body {body!r} has {unnamed.count(body)} boxes without a name, and each would be the pad "
                f"{body!r}; name them, or say in a YAML file of pads which of them are pads and "
                "which of their faces touch (docs/pads.md)"
            )


def _no_pads(shapes: Sequence[_Shape], pattern: str) -> str:
    boxes = {shape.name for shape in shapes if shape.is_box and shape.name}
    known = sorted(name for name in boxes if not name.startswith(UNNAMED))
    shown = ", ".join(known[:_NAMES_SHOWN]) or "none with a name"
    if len(known) > _NAMES_SHOWN:
        shown += f" and {len(known) - _NAMES_SHOWN} more"
    return (
        f"no box site or box geom is named {pattern!r}; boxes in the file: {shown}. Name the pads' box "
        'sites pad_*, or say which boxes are pads, like pads: "taxel_*" in a topic map, or list the '
        "pads in a YAML file beside it, which vtgtsam suggest-pads begins; docs/pads.md shows how"
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
        T_bp = np.eye(4)
        T_bp[:3, :3] = rotation_of(self._view.quat)  # type: ignore[attr-defined]
        if not np.isfinite(half).all():
            raise HandError(
                f"pad {self.name!r} must be a box of finite size, got half sides of {half.tolist()} m"
            )
        T_bp[:3, 3] = self._view.pos + half[2] * T_bp[:3, 2]  # type: ignore[attr-defined]
        return PadBox(self.name, 2 * half, self._body, T_bp, self.name)


def listed(model: mujoco.MjModel, entries: Sequence[PadEntry]) -> list[PadBox]:
    """The pads that a pads file lists.

    Raises:
        HandError: It names a body or a box that the hand does not have.
    """
    return [
        _on_geom(model, entry) if entry.face is not None else _on_body(model, entry)
        for entry in entries
    ]


def _on_body(model: mujoco.MjModel, entry: PadEntry) -> PadBox:
    assert entry.pos is not None and entry.size is not None and entry.normal is not None
    T_bp = np.eye(4)
    T_bp[:3, :3] = _facing(np.array(entry.normal), entry.along)
    T_bp[:3, 3] = entry.pos
    size = np.array([*entry.size, entry.thickness])
    return PadBox(entry.name, size, _body(model, entry), T_bp)


def _body(model: mujoco.MjModel, entry: PadEntry) -> int:
    names = [model.body(i).name for i in range(model.nbody)]
    if entry.body not in names:
        raise HandError(
            f"pad {entry.name!r}: the hand has no body {entry.body!r}; its bodies are: {', '.join(names)}"
        )
    return int(model.body(entry.body).id)


def _on_geom(model: mujoco.MjModel, entry: PadEntry) -> PadBox:
    assert entry.face is not None
    geom = _geom(model, entry)
    half = model.geom_size[geom]
    axis, sign = "xyz".index(entry.face[1]), -1.0 if entry.face[0] == "-" else 1.0
    normal = np.zeros(3)
    normal[axis] = sign
    R_gp = _facing(normal, entry.along)
    R_bg = rotation_of(model.geom_quat[geom])
    T_bp = np.eye(4)
    T_bp[:3, :3] = R_bg @ R_gp
    T_bp[:3, 3] = model.geom_pos[geom] + R_bg @ (half[axis] * normal)
    size = np.abs(R_gp.T) @ (2 * half)
    if entry.size is not None:
        size[:2] = entry.size
    return PadBox(entry.name, size, int(model.geom_bodyid[geom]), T_bp)


def _geom(model: mujoco.MjModel, entry: PadEntry) -> int:
    """Id of the box geom that an entry means: by its name, or the body's by number, or its only one."""
    is_box = model.geom_type == mujoco.mjtGeom.mjGEOM_BOX
    if isinstance(entry.geom, str):
        for i in range(model.ngeom):
            if model.geom(i).name == entry.geom:
                if not is_box[i]:
                    raise HandError(
                        f"pad {entry.name!r}: the geom {entry.geom!r} is not a box and has no face "
                        f"{entry.face!r}; give body, pos, size and normal"
                    )
                return i
        names = [model.geom(i).name for i in np.flatnonzero(is_box) if model.geom(i).name]
        raise HandError(
            f"pad {entry.name!r}: the hand has no geom {entry.geom!r}; its boxes with a name are: "
            f"{', '.join(names[:_NAMES_SHOWN]) or 'none'}"
        )
    body = _body(model, entry)
    boxes = np.flatnonzero(is_box & (model.geom_bodyid == body))
    number = entry.geom
    if number is None and len(boxes) == 1:
        number = 0
    if number is None or number >= len(boxes):
        raise HandError(
            f"pad {entry.name!r}: body {entry.body!r} has {len(boxes)} boxes; say which with geom: and its "
            "name, or its number, counted from 0"
        )
    return int(boxes[number])


def _facing(normal: np.ndarray, along: Sequence[float] | None) -> np.ndarray:
    """Axes of a pad, columns x, y, z: z the normal, x along the face.

    Where nothing says which way x lies, it is the first of the frame's own axes that is not nearly
    the normal, made to lie in the face.
    """
    z = normal / np.linalg.norm(normal)
    x = np.eye(3)[int(abs(z[0]) > 0.9)] if along is None else np.array(along, dtype=np.float64)
    x = x - (x @ z) * z
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(z, x), z])


def rotation_of(quat_wxyz: np.ndarray) -> np.ndarray:
    """Rotation matrix, shape (3, 3), of a quaternion in MuJoCo's order."""
    rotation = np.empty(9)
    mujoco.mju_quat2Mat(rotation, quat_wxyz)
    return rotation.reshape(3, 3)
