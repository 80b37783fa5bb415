# SPDX-License-Identifier: MIT
"""A hand alone that touches itself, pad to pad, as ``vtgtsam.grasp.self_touch`` plans it."""

from __future__ import annotations

from collections.abc import Sequence

import mujoco
import numpy as np

from vtgtsam import HandModel
from vtgtsam.calibration.touches import Felt
from vtgtsam.grasp import GraspDescription
from vtgtsam.grasp.self_touch import Touch, TouchController

from . import constants as c
from .scene import HAND, build_hand, pad_geom

LONGEST = 20.0  # [s], a touch that takes longer is missed


def make_touches(
    description: GraspDescription,
    hand: HandModel,
    touches: Sequence[Touch],
    zeros: np.ndarray,
) -> list[Felt]:
    """What a hand's encoders read in each touch that came about.

    Args:
        description: How the hand is open.
        hand: The hand.
        touches: The touches to make.
        zeros: By how much each encoder reads too much [rad], shape (J,).
    """
    world = _HandAlone(description, hand, zeros)
    felt = []
    for touch in touches:
        world.open()
        joints = world.make(touch)
        if joints is not None:
            felt.append(Felt(joints, touch.a, touch.b))
    return felt


class _HandAlone:
    """A simulated hand whose pads feel each other."""

    def __init__(self, description: GraspDescription, hand: HandModel, zeros: np.ndarray) -> None:
        self._model = build_hand(description, hand)
        self._data = mujoco.MjData(self._model)
        self._hand, self._zeros = hand, zeros
        names = hand.joint_names
        ids = [self._model.joint(HAND + name).id for name in names]
        self._qpos = self._model.jnt_qposadr[ids]
        driven = self._model.actuator_trnid[:, 0]
        self._servos = np.flatnonzero(np.isin(driven, ids))
        self._servo_joints = np.array([ids.index(driven[i]) for i in self._servos])
        self._start = np.array([description.start.get(name, 0.0) for name in names])
        self._pad_of_geom = np.full(self._model.ngeom, -1)
        for k, name in enumerate(hand.pad_names):
            self._pad_of_geom[self._model.geom(pad_geom(name)).id] = k

    def open(self) -> None:
        """At rest with the hand open."""
        mujoco.mj_resetData(self._model, self._data)
        self._data.qpos[self._qpos] = self._start
        self._command(self._start + self._zeros)

    def make(self, touch: Touch) -> np.ndarray | None:
        """What the encoders read when it is made; None where it is missed."""
        controller = TouchController(touch, self._start + self._zeros)
        period = c.STEPS_PER_SAMPLE * c.TIME_STEP
        for _ in range(round(LONGEST / period)):
            mujoco.mj_forward(self._model, self._data)
            self._command(controller.step(period, self._read(), self._touching()))
            if controller.done:
                break
            mujoco.mj_step(self._model, self._data, c.STEPS_PER_SAMPLE)
        return controller.joints

    def _read(self) -> np.ndarray:
        return np.asarray(self._data.qpos[self._qpos] + self._zeros)

    def _command(self, joints: np.ndarray) -> None:
        self._data.ctrl[self._servos] = (joints - self._zeros)[self._servo_joints]

    def _touching(self) -> np.ndarray:
        """Which pads another pad presses on, bool, shape (K,)."""
        touching = np.zeros(len(self._hand.pads), dtype=bool)
        pads = self._pad_of_geom[self._data.contact.geom]
        active = (pads >= 0).all(axis=1) & (self._data.contact.efc_address >= 0)
        touching[pads[active].ravel()] = True
        return touching
