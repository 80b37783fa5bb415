# SPDX-License-Identifier: MIT
"""What turns of the YCB objects look the same, as far as a depth image and a fingertip can tell; YCB does not say.

Axes come from the mesh's moments of inertia: the axis of revolution is the one whose moment differs from the other two.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from vtgtsam.mesh.symmetry import Symmetry
from vtgtsam.shapes.symmetry import BOX, CUBE

if TYPE_CHECKING:
    import trimesh

    from vtgtsam import ObjectModel

BALLS = ("013_apple", "017_orange", "055_baseball", "056_tennis_ball", "058_golf_ball")
ROUND = (
    "005_tomato_soup_can",
    "007_tuna_fish_can",
    "024_bowl",
    "040_large_marker",
    "043_phillips_screwdriver",
)
BLOCKS = {"009_gelatin_box": BOX, "026_sponge": BOX, "077_rubiks_cube": CUBE}


def symmetry_of(obj: ObjectModel) -> Symmetry | None:
    """The object's own symmetry where it has one, else that of the YCB object of its name."""
    if obj.symmetry is not None:
        return obj.symmetry
    if obj.name in BALLS:
        return _about(obj.mesh, np.eye(3)[:2])
    if obj.name in ROUND:
        return _about(obj.mesh, axis_of_revolution(obj.mesh)[None])
    block = BLOCKS.get(obj.name)
    return None if block is None else _turned(block, obj.mesh)


def axis_of_revolution(mesh: trimesh.Trimesh) -> np.ndarray:
    """The principal axis whose moment differs most from the other two's, shape (3,)."""
    moments, axes = np.linalg.eigh(mesh.moment_inertia)
    odd = 0 if moments[1] - moments[0] > moments[2] - moments[1] else 2
    return np.asarray(axes[:, odd])


def _about(mesh: trimesh.Trimesh, axes: np.ndarray) -> Symmetry:
    offset = (1e3 * mesh.center_mass).tolist()
    return {"symmetries_continuous": [{"axis": a.tolist(), "offset": offset} for a in axes]}


def _turned(block: Symmetry, mesh: trimesh.Trimesh) -> Symmetry:
    """A block's symmetries in a mesh's frame: about the axes and the centre of its oriented bounding box."""
    box = np.asarray(mesh.bounding_box_oriented.primitive.transform)
    turns: list[Any] = []
    for numbers in block["symmetries_discrete"]:
        turn = box @ np.reshape(numbers, (4, 4)) @ np.linalg.inv(box)
        turn[:3, 3] *= 1e3
        turns.append(turn.ravel().tolist())
    return {"symmetries_discrete": turns}
