# SPDX-License-Identifier: MIT
"""The objects of the datasets: built-in look-alikes, or real YCB meshes from a directory."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from vtgtsam import ObjectModel, load_object
from vtgtsam.exceptions import MeshError
from vtgtsam.shapes import NAMES

# 17 of the built-in objects, of all kinds, that the isyhand holds in at least 2 of 12 random orientations.
BUILT_IN = (
    "can", "tuna_can", "meat_can", "pudding_box", "gelatin_box", "bottle", "banana", "apple", "lemon",
    "pear", "orange", "mug", "cup", "brick", "baseball", "cube", "padlock",
)  # fmt: skip
# The same of the YCB set: 17 that it holds in at least 2 of 12 random orientations, of all kinds.
YCB = (
    "005_tomato_soup_can", "006_mustard_bottle", "007_tuna_fish_can", "009_gelatin_box",
    "010_potted_meat_can", "011_banana", "013_apple", "017_orange", "026_sponge", "038_padlock",
    "040_large_marker", "043_phillips_screwdriver", "055_baseball", "056_tennis_ball", "058_golf_ball",
    "073-a_lego_duplo", "077_rubiks_cube",
)  # fmt: skip
_SUFFIXES = (".obj", ".ply", ".stl")


def object_names(chosen: Sequence[str] | None, ycb: Path | None) -> tuple[str, ...]:
    """Names of the objects to grasp: those chosen, else the 17 of the datasets.

    Args:
        chosen: Names of built-in objects, or of files in ``ycb`` without suffix.
        ycb: Directory of YCB meshes, whose 17 then are the default.

    Raises:
        MeshError: A name is unknown.
    """
    names = tuple(chosen or (YCB if ycb else BUILT_IN))
    meshes = _meshes(ycb)
    unknown = [name for name in names if name not in NAMES and name not in meshes]
    if unknown:
        where = f"in {ycb}" if ycb else "built in (give --ycb for meshes of your own)"
        raise MeshError(
            f"no object {', '.join(unknown)} {where}; there are {', '.join([*NAMES, *meshes])}"
        )
    return names


def find_object(name: str, ycb: Path | None) -> ObjectModel:
    """An object by its name; one from a directory gets the centre of its bounding box as origin.

    The frame of YCB's files is that of the scanner's table, up to 12 cm away from the object.
    """
    if name in NAMES:
        return load_object(name)
    return load_object(_meshes(ycb)[name], origin="center")


def _meshes(folder: Path | None) -> dict[str, Path]:
    if folder is None:
        return {}
    if not folder.is_dir():
        raise MeshError(f"{folder} is no directory; give the one that holds the YCB meshes")
    return {path.stem: path for path in sorted(folder.iterdir()) if path.suffix in _SUFFIXES}
