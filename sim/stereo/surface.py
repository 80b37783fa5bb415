# SPDX-License-Identifier: MIT
"""What surfaces reflect: an albedo for each part, and a fine grain that moves with it."""

from __future__ import annotations

import mujoco
import numpy as np

from . import kernels

GRAIN = 0.08  # standard deviation of a surface's brightness from place to place, as a share of it
CELL = 0.0025  # [m], size of the grain
TABLE_ALBEDO = 0.5
_NOISE = np.random.default_rng(8).standard_normal((32, 32, 32)).astype(np.float32)
_LEFT = (2.0 / 3.0) ** 1.5  # of the noise's standard deviation, between nodes, on average


def albedo(model: mujoco.MjModel) -> np.ndarray:
    """Share of the infrared light that each geom reflects, shape (ngeom + 1,); the last is the table's.

    Infrared sees little of colour: dark parts reflect a third, white ones nine tenths.
    """
    material = model.geom_matid
    rgba = model.geom_rgba
    if model.nmat:
        rgba = np.where(material[:, None] >= 0, model.mat_rgba[material], rgba)
    return np.append(0.3 + 0.6 * rgba[:, :3].mean(axis=1), TABLE_ALBEDO)


def grain(
    model: mujoco.MjModel, data: mujoco.MjData, points_w: np.ndarray, geom: np.ndarray
) -> np.ndarray:
    """Factor on the brightness at points of geoms (-1: the table), shapes (N, 3) [m] and (N,) to (N,)."""
    noise, R_wb = np.empty(len(points_w)), data.xmat.reshape(-1, 3, 3)
    kernels.grain(points_w, geom, model.geom_bodyid, R_wb, data.xpos, _NOISE, CELL, noise)
    return 1.0 + GRAIN / _LEFT * noise
