# SPDX-License-Identifier: MIT
"""Fruit: spheres warped into shape, and a banana."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import trimesh
from scipy.interpolate import PchipInterpolator

from .shape import Shape
from .solids import ball, tube, union
from .symmetry import REVOLUTION


def _dent(u: np.ndarray, depth: float, width: float) -> np.ndarray:
    """A dimple around u = 1, where u is the cosine of the angle from its middle."""
    return depth * np.exp(-(1 - u) / width)


def _crease(directions: np.ndarray, depth: float, width: float) -> np.ndarray:
    """A groove along the meridian at +x, fading out towards both poles."""
    azimuth = np.arctan2(directions[:, 1], directions[:, 0])
    around = np.hypot(directions[:, 0], directions[:, 1])
    groove: np.ndarray = depth * around**2 * np.exp(-((azimuth / width) ** 2))
    return groove


def _stretched(radius: Callable[[np.ndarray], np.ndarray]) -> Callable[[np.ndarray], np.ndarray]:
    """A warp that only moves along the direction: ``radius`` maps directions (n, 3) to (n,)."""
    return lambda directions: directions * radius(directions)[:, None]


def _sized(mesh: trimesh.Trimesh, size_mm: tuple[float, float, float]) -> trimesh.Trimesh:
    """The mesh stretched to exactly this bounding box."""
    mesh.apply_scale(np.array(size_mm) * 1e-3 / mesh.extents)
    return mesh


def _stem(height: float, length: float) -> trimesh.Trimesh:
    """A short stem along the axis that starts at ``height``."""
    t = np.linspace(0, 1, 9)
    path = np.column_stack([np.zeros(9), np.zeros(9), height + length * t])
    return tube(path, 0.0016 * (1.25 - 0.5 * t + 0.5 * t**2), around=12)


def _apple() -> trimesh.Trimesh:
    def radius(d: np.ndarray) -> np.ndarray:
        u = d[:, 2]
        return np.asarray(1 - _dent(u, 0.36, 0.06) - _dent(-u, 0.22, 0.05) + 0.05 * u)

    return union(_sized(ball(_stretched(radius)), (75, 75, 72)), _stem(0.018, 0.017))


def _pear() -> trimesh.Trimesh:
    def warp(d: np.ndarray) -> np.ndarray:
        u = d[:, 2]
        belly = 0.66 - 0.34 * np.tanh(2.3 * (u - 0.15))
        height = u - _dent(-u, -0.06, 0.03) - _dent(u, 0.05, 0.02)
        return np.column_stack([d[:, :2] * belly[:, None], 1.35 * height])

    fruit = _sized(ball(warp), (66.2, 66.2, 92))
    top = float(fruit.bounds[1, 2])
    return union(fruit, _stem(top - 0.005, 0.013))


def _lemon() -> trimesh.Trimesh:
    """Long along z, with a nipple at one end and a smaller one where it hung."""

    def warp(d: np.ndarray) -> np.ndarray:
        u = d[:, 2]
        stretch = 1.12 + _dent(u, 0.20, 0.035) + _dent(-u, 0.10, 0.03)
        return np.column_stack([d[:, :2], u * stretch])

    return _sized(ball(warp), (54, 54, 68))


def _strawberry() -> trimesh.Trimesh:
    """Heart shaped, tip down, hollow at the top where the leaves were."""

    def warp(d: np.ndarray) -> np.ndarray:
        u = d[:, 2]
        width = 0.80 + 0.24 * np.tanh(1.6 * u + 0.3)
        return np.column_stack([d[:, :2] * width[:, None], 1.1 * u - _dent(u, 0.16, 0.08)])

    return _sized(ball(warp), (43.8, 43.8, 55))


def _orange() -> trimesh.Trimesh:
    def radius(d: np.ndarray) -> np.ndarray:
        u = d[:, 2]
        return np.asarray(1 - _dent(u, 0.05, 0.01) - _dent(-u, 0.03, 0.006))

    return _sized(ball(_stretched(radius)), (73, 73, 71))


def _peach() -> trimesh.Trimesh:
    def radius(d: np.ndarray) -> np.ndarray:
        u = d[:, 2]
        return np.asarray(1 - _dent(u, 0.20, 0.04) + _dent(-u, 0.05, 0.02) - _crease(d, 0.07, 0.16))

    return _sized(ball(_stretched(radius)), (62, 60, 59))


def _plum() -> trimesh.Trimesh:
    def radius(d: np.ndarray) -> np.ndarray:
        return np.asarray(1 - _dent(d[:, 2], 0.12, 0.03) - _crease(d, 0.09, 0.16))

    return _sized(ball(_stretched(radius)), (52, 52, 55))


def _banana() -> trimesh.Trimesh:
    """Five-sided and curved in the plane z = 0, with a stem at one end and a blunt tip at the other."""
    t = np.linspace(0, 1, 90)
    # Its direction turns by 96 degrees, most of it in the middle.
    angle = np.radians(96 * (t - 0.5 - 0.056 * np.sin(2 * np.pi * t)))
    steps = np.column_stack([np.cos(angle), np.zeros_like(t), np.sin(angle)]) / len(t)
    path = 0.205 * np.cumsum(steps, axis=0)
    # Radius along the fruit [m]: tip, belly, neck, stem.
    along = [0.00, 0.012, 0.04, 0.10, 0.25, 0.50, 0.68, 0.80, 0.86, 0.91, 0.97, 1.00]
    radii = [2.5, 4.5, 6.5, 11.5, 16.2, 18.2, 16.5, 11.5, 7.5, 5.6, 5.6, 6.2]
    radius = PchipInterpolator(along, np.array(radii) * 1e-3)(t)
    angles = 2 * np.pi * np.arange(40) / 40
    mesh = tube(path, radius, around=40, section=1 + 0.045 * np.cos(5 * angles))
    mesh.apply_transform(trimesh.transformations.rotation_matrix(-np.pi / 2, [1, 0, 0]))
    return _sized(mesh, (190, 70, 36))


SHAPES = (
    Shape("banana", "011_banana", (190, 70, 36), 0.066, _banana),
    Shape("strawberry", "012_strawberry", (43.8, 43.8, 55), 0.018, _strawberry, REVOLUTION),
    Shape("apple", "013_apple", (75, 75, 72), 0.068, _apple, REVOLUTION),
    Shape("lemon", "014_lemon", (54, 54, 68), 0.029, _lemon, REVOLUTION),
    Shape("peach", "015_peach", (62, 60, 59), 0.033, _peach),
    Shape("pear", "016_pear", (66.2, 66.2, 100), 0.049, _pear, REVOLUTION),
    Shape("orange", "017_orange", (73, 73, 71), 0.047, _orange, REVOLUTION),
    Shape("plum", "018_plum", (52, 52, 55), 0.025, _plum),
)
