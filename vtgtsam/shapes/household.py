# SPDX-License-Identifier: MIT
"""Tableware, toys and tools."""

from __future__ import annotations

import numpy as np
import trimesh

from .shape import Shape
from .solids import ball, loft, revolve, rounded_box, rounded_rectangle, tube, union
from .symmetry import BOX, CUBE, EIGHTFOLD, REVOLUTION, SPHERE, SQUARE, TWOFOLD


def _mug() -> trimesh.Trimesh:
    """Mug of 80 mm with walls of 3.5 mm and a handle along +x."""
    outside = [
        (0, 0.0015),
        (0.027, 0.0015),
        (0.0285, 0),
        (0.0345, 0),
        (0.0385, 0.003),
        (0.0400, 0.008),
    ]
    rim = [(0.0400, 0.0795), (0.0392, 0.0815), (0.03825, 0.082), (0.0373, 0.0815), (0.0365, 0.0795)]
    inside = [(0.0365, 0.009), (0.0340, 0.0055), (0, 0.005)]
    t = np.linspace(0, np.pi, 40)
    # A flattened arch that starts and ends inside the wall.
    path = np.column_stack(
        [0.0380 + 0.0355 * np.sin(t) ** 0.6, np.zeros_like(t), 0.041 + 0.027 * np.cos(t)]
    )
    angles = 2 * np.pi * np.arange(20) / 20
    oval = 1 / np.sqrt(np.cos(angles) ** 2 / 0.55**2 + np.sin(angles) ** 2)
    handle = tube(path, 0.0065, around=20, section=oval)
    return union(revolve([*outside, *rim, *inside], 0.0035), handle)


def _cup() -> trimesh.Trimesh:
    """Conical toy cup with walls of 2 mm and a rim."""
    outside = [
        (0, 0),
        (0.030, 0),
        (0.0315, 0.0015),
        (0.0395, 0.066),
        (0.0425, 0.0665),
        (0.0425, 0.0715),
    ]
    inside = [(0.0420, 0.072), (0.0385, 0.072), (0.0380, 0.0715), (0.0297, 0.0025), (0, 0.002)]
    return revolve([*outside, *inside], 0.0035)


def _ball(diameter: float) -> trimesh.Trimesh:
    return ball(lambda directions: directions * diameter / 2)


def _marker() -> trimesh.Trimesh:
    """Thick felt pen: barrel, cap and the step between them."""
    profile = [
        (0, -0.0605),
        (0.0055, -0.0605),
        (0.0062, -0.0598),
        (0.0065, -0.057),
        (0.0083, -0.0565),
    ]
    profile += [(0.0085, -0.055), (0.0085, 0.020), (0.0090, 0.0205), (0.0090, 0.055)]
    profile += [(0.0080, 0.0595), (0.0070, 0.0605), (0, 0.0605)]
    return revolve(profile, 0.0018, around=40)


def _screwdriver() -> trimesh.Trimesh:
    """Fluted handle along z, round shaft with a pointed end below it."""
    handle = [
        (0.006, 0.115),
        (0.010, 0.117),
        (0.012, 0.122),
        (0.0110, 0.128),
        (0.0120, 0.138),
        (0.0150, 0.150),
    ]
    handle += [(0.0155, 0.165), (0.0150, 0.195), (0.0135, 0.209), (0.0090, 0.2145), (0.004, 0.215)]
    dense = _refined(np.array(handle), 0.0025)
    angles = 2 * np.pi * np.arange(48) / 48
    depth = (
        0.06
        * np.clip((dense[:, 1] - 0.138) / 0.012, 0, 1)
        * np.clip((0.212 - dense[:, 1]) / 0.012, 0, 1)
    )
    radii = dense[:, :1] * (1 - depth[:, None] * (0.5 - 0.5 * np.cos(8 * angles)))
    z = np.broadcast_to(dense[:, 1:], radii.shape)
    grip = loft(np.stack([radii * np.cos(angles), radii * np.sin(angles), z], axis=-1))
    shaft = [(0, 0), (0.0008, 0), (0.0030, 0.005), (0.0032, 0.006), (0.0032, 0.118), (0, 0.118)]
    return union(grip, revolve(shaft, 0.002, around=24))


def _drill() -> trimesh.Trimesh:
    """Cordless drill: motor with chuck along +x, leaning handle, battery as its foot."""
    barrel = [
        (0, -0.070),
        (0.018, -0.070),
        (0.0245, -0.066),
        (0.0285, -0.056),
        (0.0285, 0.030),
        (0.0250, 0.044),
    ]
    barrel += [
        (0.0225, 0.046),
        (0.0225, 0.062),
        (0.0200, 0.064),
        (0.0200, 0.098),
        (0.0150, 0.108),
        (0.0080, 0.114),
        (0, 0.114),
    ]
    motor = revolve(barrel, 0.0045, around=56)
    motor.apply_transform(trimesh.transformations.rotation_matrix(np.pi / 2, [0, 1, 0]))
    rings = []
    for t in np.linspace(0, 1, 30):
        bulge = 0.0025 * np.sin(np.pi * t)
        ring = rounded_rectangle(0.046 + 2 * bulge, 0.034 + bulge, 0.014, 56)
        rings.append(
            np.column_stack(
                [ring[:, 0] - 0.026 - 0.014 * t, ring[:, 1], np.full(56, -0.010 - 0.110 * t)]
            )
        )
    foot = rounded_box((0.095, 0.054, 0.042), 0.006, 22)
    foot.apply_translation([-0.0225, 0, -0.1375])
    return union(motor, loft(np.array(rings)), foot)


def _padlock() -> trimesh.Trimesh:
    """Brass body with a round shackle above it."""
    body = rounded_box((0.047, 0.024, 0.034), 0.003, 26)
    t = np.linspace(0, np.pi, 28)
    arch = np.column_stack([0.0155 * np.cos(t), np.zeros_like(t), 0.0285 + 0.0155 * np.sin(t)])
    leg = np.linspace(0.012, 0.0265, 8)
    zero = np.zeros_like(leg)
    path = np.concatenate(
        [
            np.column_stack([zero + 0.0155, zero, leg]),
            arch,
            np.column_stack([zero - 0.0155, zero, leg[::-1]]),
        ]
    )
    return union(body, tube(path, 0.0040, around=24))


def _refined(corners: np.ndarray, step: float) -> np.ndarray:
    along = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(corners, axis=0), axis=1))])
    at = np.union1d(along, np.linspace(0, along[-1], int(along[-1] / step)))
    return np.column_stack([np.interp(at, along, corners[:, d]) for d in range(2)])


SHAPES = (
    Shape("mug", "025_mug", (117, 80, 82), 0.118, _mug),
    Shape("cup", "065-g_cups", (85, 85, 72), 0.028, _cup, REVOLUTION),
    Shape(
        "sponge",
        "026_sponge",
        (114, 72, 14),
        0.0062,
        lambda: rounded_box((0.114, 0.072, 0.014), 0.003, 40),
        BOX,
    ),
    Shape(
        "brick",
        "061_foam_brick",
        (50, 50, 75),
        0.028,
        lambda: rounded_box((0.050, 0.050, 0.075), 0.0025, 28),
        SQUARE,
    ),
    Shape(
        "block",
        "036_wood_block",
        (85, 85, 200),
        0.729,
        lambda: rounded_box((0.085, 0.085, 0.200), 0.002, 44),
        SQUARE,
    ),
    Shape("ball", "056_tennis_ball", (64.7, 64.7, 64.7), 0.058, lambda: _ball(0.0647), SPHERE),
    Shape("baseball", "055_baseball", (75, 75, 75), 0.138, lambda: _ball(0.075), SPHERE),
    Shape("golf_ball", "058_golf_ball", (42.7, 42.7, 42.7), 0.046, lambda: _ball(0.0427), SPHERE),
    Shape(
        "cube",
        "077_rubiks_cube",
        (57, 57, 57),
        0.094,
        lambda: rounded_box((0.057, 0.057, 0.057), 0.002, 24),
        CUBE,
    ),
    Shape("marker", "040_large_marker", (18, 18, 121), 0.0158, _marker, REVOLUTION),
    Shape("screwdriver", "043_phillips_screwdriver", (31, 31, 215), 0.097, _screwdriver, EIGHTFOLD),
    Shape("padlock", "038_padlock", (47, 24, 65), 0.208, _padlock, TWOFOLD),
    Shape("drill", "035_power_drill", (184, 57, 187), 0.895, _drill),
)
