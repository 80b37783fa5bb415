# SPDX-License-Identifier: MIT
"""The built-in objects: look-alikes of YCB objects, made by code from the published sizes.

Sizes are those of Calli et al., "The YCB object and Model set", ICAR 2015, table I, masses those
published with the set. Nothing of the scanned meshes is in here.
"""

from __future__ import annotations

from . import fruit, groceries, household
from .shape import Shape as Shape

CATALOGUE: dict[str, Shape] = {
    shape.name: shape for shape in (*groceries.SHAPES, *fruit.SHAPES, *household.SHAPES)
}
NAMES = tuple(CATALOGUE)
