# SPDX-License-Identifier: MIT
"""Joints that follow others (URDF ``mimic``, MJCF ``equality``), and chains of links that close."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import mujoco
import numpy as np


@dataclass(frozen=True)
class Coupling:
    """A joint that follows another: q = zero + polynomial(q_driver - driver_zero)."""

    driver: str
    zero: float
    driver_zero: float
    polynomial: np.ndarray

    def angle(self, driver_angle: float) -> float:
        """The joint's value [rad or m] where its driver's is this."""
        powers = (driver_angle - self.driver_zero) ** np.arange(len(self.polynomial))
        return float(self.zero + self.polynomial @ powers)


def couplings(model: mujoco.MjModel) -> dict[str, Coupling]:
    """The joints that follow another, by name."""
    found = {}
    for i in np.flatnonzero(model.eq_type == mujoco.mjtEq.mjEQ_JOINT):
        joint, driver = model.eq_obj1id[i], model.eq_obj2id[i]
        if driver >= 0 and model.eq_active0[i]:
            found[model.joint(joint).name] = Coupling(
                model.joint(driver).name,
                model.qpos0[joint],
                model.qpos0[driver],
                model.eq_data[i, :5].copy(),
            )
    return found


def completed(joints: Mapping[str, float], followers: Mapping[str, Coupling]) -> dict[str, float]:
    """The joints with those that follow from them, along chains in whatever order they are declared."""
    known = dict(joints)
    waiting = {name: coupling for name, coupling in followers.items() if name not in known}
    while ready := [name for name, coupling in waiting.items() if coupling.driver in known]:
        for name in ready:
            coupling = waiting.pop(name)
            known[name] = coupling.angle(known[coupling.driver])
    return known


def closed_chains(model: mujoco.MjModel) -> list[tuple[str, str]]:
    """Pairs of bodies that a constraint (``connect``, ``weld``) ties together besides the joints."""
    pairs = []
    for i in range(model.neq):
        kind = mujoco.mjtEq(model.eq_type[i])
        if kind not in (mujoco.mjtEq.mjEQ_CONNECT, mujoco.mjtEq.mjEQ_WELD):
            continue
        ends = model.eq_obj1id[i], model.eq_obj2id[i]
        if model.eq_objtype[i] == mujoco.mjtObj.mjOBJ_SITE:
            ends = model.site_bodyid[ends[0]], model.site_bodyid[ends[1]]
        pairs.append((model.body(ends[0]).name, model.body(ends[1]).name))
    return pairs
