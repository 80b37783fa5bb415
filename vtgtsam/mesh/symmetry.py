# SPDX-License-Identifier: MIT
"""Symmetries of an object in BOP's form: read, checked, and moved to another origin.

BOP's ``models_info.json`` holds an entry for each mesh, ``{"5": {"symmetries_discrete": [[16 numbers], ...],
"symmetries_continuous": [{"axis": [0, 0, 1], "offset": [0, 0, 0]}]}}``, in millimetres and in the mesh's
frame: https://github.com/thodan/bop_toolkit/blob/master/docs/bop_datasets_format.md
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from .. import limits
from ..exceptions import MeshError
from ..input.text import parse_json, read_bytes

Symmetry = dict[str, Any]

FILE = "models_info.json"
DISCRETE, CONTINUOUS = "symmetries_discrete", "symmetries_continuous"
TOLERANCE = 1e-3  # of a rotation's entries: files give a few digits


def read_symmetry(
    source: Symmetry | str | Path, center: np.ndarray | Sequence[float] = (0.0, 0.0, 0.0)
) -> Symmetry | None:
    """The symmetry that a caller gave, in BOP's form.

    Args:
        source: An entry of BOP's file; its text; the path of a JSON file that holds one, or of a
            ``models_info.json`` with "#" and the object's number; "x", "y" or "z" for any turn about that
            axis through ``center``; or "none".
        center: Middle of the object [m], shape (3,).

    Raises:
        MeshError: It is none of these.
    """
    if isinstance(source, Mapping):
        return _checked(source, "the symmetry")
    text = str(source)
    if text == "none":
        return None
    if text in ("x", "y", "z"):
        offset = [float(v) for v in np.asarray(center) * 1e3]
        axis = [float(text == name) for name in "xyz"]
        return {CONTINUOUS: [{"axis": axis, "offset": offset}]}
    if text.lstrip().startswith("{"):
        return _checked(_json(text, "the symmetry"), "the symmetry")
    name, _, number = text.partition("#")
    path = Path(name).expanduser()
    if not path.is_file():
        raise MeshError(
            f"symmetry {text!r}: expected x, y, z, none, an entry of BOP's {FILE} as JSON, or a file with one "
            f"(of several objects: {FILE}#5)"
        )
    content = _json(_read(path), str(path))
    if number:
        if number not in content:
            raise MeshError(
                f"{path} has no object {number!r}; it has: {', '.join(list(content)[:20])}"
            )
        content = content[number]
    elif not {DISCRETE, CONTINUOUS} & set(content) and all(key.isdigit() for key in content):
        raise MeshError(
            f"{path} holds {len(content)} objects; say which, like {path}#{next(iter(content), 1)}"
        )
    return _checked(content, str(path))


def symmetry_beside(mesh: Path) -> Symmetry | None:
    """The symmetry that a ``models_info.json`` beside a mesh gives it, by the number in the mesh's name.

    Raises:
        MeshError: There is such a file, and it is damaged.
    """
    path = mesh.parent / FILE
    number = re.fullmatch(r"(?:obj_)?0*(\d+)", mesh.stem)
    if number is None or not path.is_file():
        return None
    entry = _json(_read(path), str(path)).get(number[1])
    return None if entry is None else _checked(entry, f"{path}, object {number[1]}")


def shifted(symmetry: Symmetry, shift: np.ndarray) -> Symmetry:
    """The same symmetry in a frame whose origin lies at ``-shift`` (3,) [m]: p_new = p_old + shift.

    Axes go along with their points. A turn p -> R p + t becomes p -> R p + t + (I - R) shift.
    """
    moved: Symmetry = {}
    shift_mm = np.asarray(shift) * 1e3
    if axes := symmetry.get(CONTINUOUS):
        moved[CONTINUOUS] = [
            {"axis": a["axis"], "offset": [float(v) for v in np.asarray(a["offset"]) + shift_mm]}
            for a in axes
        ]
    if turns := symmetry.get(DISCRETE):
        moved[DISCRETE] = [_shifted_turn(turn, shift_mm) for turn in turns]
    return moved


def _shifted_turn(turn: list[float], shift_mm: np.ndarray) -> list[float]:
    transform = np.reshape(turn, (4, 4)).astype(np.float64)
    transform[:3, 3] += (np.eye(3) - transform[:3, :3]) @ shift_mm
    return [float(v) for v in transform.ravel()]


def _read(path: Path) -> str:
    try:
        return read_bytes(path, limits.TEXT_BYTES, MeshError).decode()
    except UnicodeDecodeError as error:
        raise MeshError(f"{path} cannot be read: {error}") from None


def _json(text: str, name: str) -> dict[str, Any]:
    content = parse_json(text, name, MeshError)
    if not isinstance(content, dict):
        raise MeshError(f"{name} must be a JSON object, got {type(content).__name__}")
    return content


def _checked(entry: Any, name: str) -> Symmetry | None:
    """The entry's symmetries alone, as floats; None where it has none."""
    if not isinstance(entry, Mapping):
        raise MeshError(f"{name} must be an entry of BOP's {FILE}, got {entry!r:.60}")
    found: Symmetry = {}
    try:
        if turns := entry.get(DISCRETE):
            found[DISCRETE] = [_turn(turn) for turn in turns]
        if axes := entry.get(CONTINUOUS):
            found[CONTINUOUS] = [
                {"axis": _axis(a["axis"]), "offset": _three(a.get("offset", (0, 0, 0)))}
                for a in axes
            ]
    except (TypeError, ValueError, KeyError, AttributeError) as error:
        raise MeshError(
            f"{name}: {error}; a discrete symmetry is 16 numbers, the rows of a rotation with a translation "
            'in mm, a continuous one {"axis": [0, 0, 1], "offset": [0, 0, 0]}'
        ) from None
    return found or None


def _turn(turn: Any) -> list[float]:
    T = np.asarray(turn, dtype=np.float64).reshape(4, 4)
    R = T[:3, :3]
    proper = np.abs(R @ R.T - np.eye(3)).max() < TOLERANCE and np.linalg.det(R) > 0
    if not (np.isfinite(T).all() and proper and np.allclose(T[3], (0, 0, 0, 1))):
        raise ValueError(f"{np.round(T, 3).tolist()} is no rotation with a translation")
    return [float(v) for v in T.ravel()]


def _axis(axis: Any) -> list[float]:
    numbers = _three(axis)
    if np.linalg.norm(numbers) < 1e-9:
        raise ValueError("the axis is zero")
    return numbers


def _three(value: Any) -> list[float]:
    numbers = np.asarray(value, dtype=np.float64)
    if numbers.shape != (3,) or not np.isfinite(numbers).all():
        raise ValueError(f"{value!r} is not three numbers")
    return [float(v) for v in numbers]
