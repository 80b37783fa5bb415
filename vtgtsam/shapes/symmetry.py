# SPDX-License-Identifier: MIT
"""Symmetries in the form of BOP's ``models_info.json``, about the origin of a shape's frame."""

from __future__ import annotations

from typing import Any

import numpy as np

Symmetry = dict[str, Any]

_X, _Y, _Z = np.eye(3)


def _turn(axis: np.ndarray, fraction: float) -> list[float]:
    """Rotation by a fraction of a full turn, as BOP's 16 numbers (4 x 4, row by row)."""
    angle = 2 * np.pi * fraction
    skew = np.cross(np.eye(3), -axis)
    transform = np.eye(4)
    transform[:3, :3] += np.sin(angle) * skew + (1 - np.cos(angle)) * skew @ skew
    return [float(x) for x in (np.round(transform, 12) + 0.0).ravel()]


def _about(axis: np.ndarray) -> dict[str, list[float]]:
    return {"axis": axis.tolist(), "offset": [0.0, 0.0, 0.0]}


# Any turn about z; about z and also upside down; any turn at all.
REVOLUTION: Symmetry = {"symmetries_continuous": [_about(_Z)]}
SPINDLE: Symmetry = {**REVOLUTION, "symmetries_discrete": [_turn(_X, 1 / 2)]}
SPHERE: Symmetry = {"symmetries_continuous": [_about(_X), _about(_Z)]}
# Half a turn about z; eighths of a turn about z; half turns about all three axes.
TWOFOLD: Symmetry = {"symmetries_discrete": [_turn(_Z, 1 / 2)]}
EIGHTFOLD: Symmetry = {"symmetries_discrete": [_turn(_Z, k / 8) for k in range(1, 8)]}
BOX: Symmetry = {"symmetries_discrete": [_turn(axis, 1 / 2) for axis in (_X, _Y, _Z)]}


def _group(generators: list[np.ndarray]) -> list[list[float]]:
    """All products of the generators but the identity."""
    found = [np.eye(4)]
    for element in found:  # grows while it is walked
        for generator in generators:
            product = np.round(element @ generator, 12)
            if not any(np.allclose(product, other) for other in found):
                found.append(product)
    return [[float(x) for x in (element + 0.0).ravel()] for element in found[1:]]


def _quarter(axis: np.ndarray) -> np.ndarray:
    return np.reshape(_turn(axis, 1 / 4), (4, 4))


# A square block: quarter turns about z and half turns across it. A cube: all 23 turns.
SQUARE: Symmetry = {
    "symmetries_discrete": _group([_quarter(_Z), np.reshape(_turn(_X, 1 / 2), (4, 4))])
}
CUBE: Symmetry = {"symmetries_discrete": _group([_quarter(_X), _quarter(_Z)])}


def moved(symmetry: Symmetry, center: np.ndarray) -> Symmetry:
    """The same symmetry where the shape's centre lies at ``center`` (3,) [m] of the object frame.

    BOP's offsets and translations are in millimetres.
    """
    result: Symmetry = {}
    if axes := symmetry.get("symmetries_continuous"):
        offset = [float(x) for x in np.asarray(center) * 1e3]
        result["symmetries_continuous"] = [{"axis": a["axis"], "offset": offset} for a in axes]
    if turns := symmetry.get("symmetries_discrete"):
        result["symmetries_discrete"] = [_turn_about(turn, center) for turn in turns]
    return result


def _turn_about(turn: list[float], center: np.ndarray) -> list[float]:
    transform = np.reshape(turn, (4, 4)).copy()
    transform[:3, 3] = (np.eye(3) - transform[:3, :3]) @ np.asarray(center) * 1e3
    return [float(x) for x in transform.ravel()]
