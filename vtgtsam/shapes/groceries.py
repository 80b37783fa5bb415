# SPDX-License-Identifier: MIT
"""Cans, boxes and a bottle."""

from __future__ import annotations

import numpy as np
import trimesh
from scipy.interpolate import PchipInterpolator

from .shape import Shape
from .solids import revolve, rounded_box, rounded_rectangle, sections
from .symmetry import BOX, SPINDLE, TWOFOLD


def _tin(diameter: float, height: float, step: float) -> trimesh.Trimesh:
    """Tin with a seam of 1.5 mm around each sunken end."""
    seam, lip, sunken = diameter / 2, 0.003, 0.002
    wall, inner, h = seam - 0.0015, seam - 0.003, height / 2
    bottom = [(0, sunken - h), (inner, sunken - h), (inner, -h), (seam, -h), (seam, lip - h)]
    lower = [*bottom, (wall, lip + 0.0015 - h)]
    return revolve([*lower, *((r, -z) for r, z in reversed(lower))], step)


def _meat_can() -> trimesh.Trimesh:
    """Tin of oblong section with a seam around its bottom and a slightly smaller top."""

    def outline(inset: float, z: float) -> np.ndarray:
        ring = rounded_rectangle(0.097 - 2 * inset, 0.050 - 2 * inset, 0.022 - inset, 88)
        return np.column_stack([ring, np.full(len(ring), z)])

    profile = [(0.021, 0.002), (0.004, 0.002), (0.003, 0), (0, 0), (0, 0.003), (0.0015, 0.0045)]
    profile += [(0.0015, 0.076), (0.003, 0.081), (0.004, 0.082), (0.006, 0.0805), (0.021, 0.0805)]
    return sections(outline, profile, 0.0035)


# Half width along x and y, and how square the section is, at heights z of a mustard bottle [m].
_BOTTLE = np.array(
    [
        (0.0440, 0.0250, 3.0, 0.000),
        (0.0465, 0.0280, 3.0, 0.002),
        (0.0475, 0.0290, 3.0, 0.006),
        (0.0475, 0.0290, 3.0, 0.030),
        (0.0455, 0.0282, 2.8, 0.060),
        (0.0465, 0.0288, 2.6, 0.085),
        (0.0460, 0.0286, 2.5, 0.100),
        (0.0425, 0.0272, 2.3, 0.115),
        (0.0360, 0.0245, 2.1, 0.128),
        (0.0260, 0.0205, 2.0, 0.138),
        (0.0185, 0.0170, 2.0, 0.143),
        (0.0165, 0.0162, 2.0, 0.146),
        (0.0165, 0.0165, 2.0, 0.150),
    ]
)
_CAP = [(0.0165, 0.150), (0.019, 0.1505), (0.0195, 0.152), (0.0195, 0.166), (0.0185, 0.168)]
_CAP += [(0.0085, 0.1685), (0.0075, 0.170), (0.0055, 0.188), (0.0045, 0.190)]


def _bottle() -> trimesh.Trimesh:
    """Squeeze bottle of oval section, with shoulders and a nozzle cap."""
    shape = PchipInterpolator(_BOTTLE[:, 3], _BOTTLE[:, :3])
    angles = 2 * np.pi * np.arange(72) / 72
    cosine, sine = np.cos(angles), np.sin(angles)

    def body(inset: float, z: float) -> np.ndarray:
        a, b, power = shape(z)
        x = (a - inset) * np.sign(cosine) * np.abs(cosine) ** (2 / power)
        y = (b - inset) * np.sign(sine) * np.abs(sine) ** (2 / power)
        return np.column_stack([x, y, np.full(len(angles), z)])

    bottom = [body(inset, 0.0) for inset in (0.020, 0.016, 0.012, 0.008, 0.004)]
    heights = np.concatenate([_BOTTLE[:3, 3], np.linspace(0.010, 0.125, 33), _BOTTLE[8:, 3]])
    cap = np.concatenate(
        [np.linspace(a, b, 4)[1:] for a, b in zip(_CAP[:-1], _CAP[1:], strict=True)]
    )
    top = [np.column_stack([r * cosine, r * sine, np.full(len(angles), z)]) for r, z in cap]
    from .solids import loft

    return loft(np.array([*bottom, *(body(0.0, z) for z in heights), *top]))


SHAPES = (
    Shape(
        "can",
        "005_tomato_soup_can",
        (66, 66, 101),
        0.349,
        lambda: _tin(0.066, 0.101, 0.0032),
        SPINDLE,
    ),
    Shape(
        "tuna_can",
        "007_tuna_fish_can",
        (85, 85, 33),
        0.171,
        lambda: _tin(0.085, 0.033, 0.0032),
        SPINDLE,
    ),
    Shape(
        "coffee_can",
        "002_master_chef_can",
        (102, 102, 139),
        0.414,
        lambda: _tin(0.102, 0.139, 0.0045),
        SPINDLE,
    ),
    Shape("meat_can", "010_potted_meat_can", (97, 50, 82), 0.370, _meat_can, TWOFOLD),
    Shape(
        "box",
        "004_sugar_box",
        (38, 89, 175),
        0.514,
        lambda: rounded_box((0.038, 0.089, 0.175), 0.0015, 44),
        BOX,
    ),
    Shape(
        "pudding_box",
        "008_pudding_box",
        (110, 89, 35),
        0.187,
        lambda: rounded_box((0.110, 0.089, 0.035), 0.0015, 32),
        BOX,
    ),
    Shape(
        "gelatin_box",
        "009_gelatin_box",
        (85, 73, 28),
        0.097,
        lambda: rounded_box((0.085, 0.073, 0.028), 0.0015, 30),
        BOX,
    ),
    Shape("bottle", "006_mustard_bottle", (95, 58, 190), 0.603, _bottle, TWOFOLD),
)
