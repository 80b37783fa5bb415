# SPDX-License-Identifier: MIT
"""Pads laid around an object as a hand lays them: a palm on one side, fingers around the other."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vtgtsam import GridSdf, Pad

from .motion import random_pose

AZIMUTHS = np.radians([105.0, 180.0, 255.0])  # of a finger's three pads; the palm is at 0
PALM_SPREAD = np.radians(20.0)
CLOSE, MOST_STEPS = 1e-5, 40  # [m]


class Grasp:
    """Pads around an object.

    Args:
        rng: Randomness of the placement.
        sdf: The object's distance field.
        pads: The pads; the largest quarter are the palm's.
    """

    def __init__(self, rng: np.random.Generator, sdf: GridSdf, pads: Sequence[Pad]) -> None:
        self.sdf, self.pads = sdf, pads
        inside = np.argwhere(sdf.values < 0)
        self.bottom, self.top = sdf.lower + sdf.spacing * (inside.min(0), inside.max(0))
        self.reach = float(np.linalg.norm(sdf.upper - sdf.lower)) / 2
        areas = [pad.size.prod() for pad in pads]
        palm = np.argsort(areas, kind="stable")[len(pads) - len(pads) // 4 :]
        fingers = np.setdiff1d(np.arange(len(pads)), palm)
        self.T_op = np.tile(np.eye(4), (len(pads), 1, 1))
        for n, k in enumerate(fingers):
            rows = -(-len(fingers) // 3)
            self.T_op[k] = self._facing(rng, AZIMUTHS[n % 3], (n // 3 + 0.5) / rows)
        for n, k in enumerate(palm):
            azimuth = PALM_SPREAD * (-1) ** n
            self.T_op[k] = self._facing(rng, azimuth, (n // 2 + 0.5) / max(1, len(palm) / 2))

    def closed(self, T_op: np.ndarray, gaps: np.ndarray) -> np.ndarray:
        """The pads (K, 4, 4) moved along their normals until they are ``gaps`` (K,) from the object.

        Each step is the distance that is left; out of a deep wall it takes many.
        """
        T_op = T_op.copy()
        for _ in range(MOST_STEPS):
            ahead = self.distances(T_op) - gaps
            T_op[:, :3, 3] += ahead[:, None] * T_op[:, :3, 2]
            if np.abs(ahead).max() < CLOSE:
                break
        return T_op

    def distances(self, T_op: np.ndarray) -> np.ndarray:
        """Least signed distance of each pad's points [m], shape (K,), for pads at T_op (K, 4, 4)."""
        points = [
            pad.points_p @ T[:3, :3].T + T[:3, 3] for pad, T in zip(self.pads, T_op, strict=True)
        ]
        starts = np.cumsum([0, *(len(p) for p in points)])[:-1]
        return np.minimum.reduceat(self.sdf.value(np.concatenate(points)), starts)

    def _facing(self, rng: np.random.Generator, azimuth: float, height: float) -> np.ndarray:
        """A pad pose on the surface, +z into the object and some degrees from straight.

        A ray from outside at this azimuth and share of the object's height; where it misses, one nearby.
        """
        for attempt in range(100):
            jitter = 0.08 * (1 + attempt / 10)
            angle = azimuth + rng.normal(0, jitter)
            share = np.clip(0.1 + 0.8 * height + rng.normal(0, jitter / 4), 0, 1)
            hit = self._hit(angle, self.bottom[2] + share * (self.top[2] - self.bottom[2]))
            if hit is not None:
                return np.asarray(_looking(*hit) @ random_pose(rng, 0.05, 0.0))
        raise ValueError("no ray meets the object; is the field's sign right?")

    def _hit(self, azimuth: float, z: float) -> tuple[np.ndarray, np.ndarray] | None:
        axis = np.append((self.bottom + self.top)[:2] / 2, z)
        outward = np.array([np.cos(azimuth), np.sin(azimuth), 0.0])
        ray = axis + np.linspace(0, self.reach, 500)[:, None] * outward
        inside = np.flatnonzero(self.sdf.value(ray) < 0)
        if not len(inside):
            return None
        point = ray[inside[-1]]
        normal = self.sdf.value_and_gradient(point[None])[1][0]
        return point, normal / np.linalg.norm(normal)


def _looking(point: np.ndarray, normal: np.ndarray) -> np.ndarray:
    z = -normal
    x = np.cross(np.eye(3)[np.argmin(np.abs(z))], z)
    x /= np.linalg.norm(x)
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = np.column_stack([x, np.cross(z, x), z]), point
    return T
