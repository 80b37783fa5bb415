# SPDX-License-Identifier: MIT
"""A MuJoCo hand and an object, as what emulated servos move, emulated pads feel and a camera sees.

Simulated time follows the time that really passes: whoever calls ``advance`` says how much that was.
The servos' torque is limited by their current caps; without torque the fingers are limp. The object
hangs out of everyone's way until it is put on the palm.
"""

from __future__ import annotations

import threading
from collections.abc import Mapping, Sequence

import mujoco
import numpy as np

from sim import constants as c
from sim.scene import HAND, OBJECT
from sim.world import World

from .motor import JointDrive, JointMotion

TORQUE_PER_AMPERE = c.STALL_TORQUE / 1.47  # [N m/A], XL330-M288-T at 5 V: 0.52 N m at 1.47 A
AWAY = np.array([0.0, 0.0, -5.0])  # [m], where the object is before it is put on the palm
_LONGEST = 0.5  # [s], simulated in one go; a computer that was asleep for longer has lost the time


class SimulatedHand:
    """The simulated world behind the emulators; may be used from several threads.

    Args:
        world: Hand and object.

    Attributes:
        lock: Held while the simulation runs or is looked at.
        lost: Time that passed without being simulated, because the computer was too slow [s].
        torque: Whether each joint's motor was driven when last told, shape (J,).
    """

    def __init__(self, world: World) -> None:
        self.lock = threading.Lock()
        self.lost = 0.0
        self.torque = np.zeros(len(world.hand.joint_names), dtype=bool)
        self._world = world
        self._names = world.hand.joint_names
        model = world.model
        self._servos = np.array([_servo_of(model, name) for name in self._names])
        self._dofs = np.array([model.joint(HAND + name).dofadr[0] for name in self._names])
        self._object = int(model.joint(OBJECT).qposadr[0])
        self._object_dof = int(model.joint(OBJECT).dofadr[0])
        self._goals = world.start.copy()
        self._owed = 0.0  # [s], passed and not yet simulated
        self._away = True
        T_wo = np.eye(4)
        T_wo[:3, 3] = AWAY
        world.place(T_wo)

    def put(self, T_wo: np.ndarray) -> None:
        """Put the object there, shape (4, 4), at rest."""
        with self.lock:
            pose = self._world.data.qpos[self._object : self._object + 7]
            pose[:3] = T_wo[:3, 3]
            mujoco.mju_mat2Quat(pose[3:], np.ascontiguousarray(T_wo[:3, :3]).ravel())
            self._away = False
            self._rest()

    def advance(self, dt: float, drives: Mapping[str, JointDrive]) -> dict[str, JointMotion]:
        """Let ``dt`` [s] pass under these drives; motions by joint name."""
        with self.lock:
            self._owed += dt
            self.lost += max(0.0, self._owed - _LONGEST)
            steps = int(min(self._owed, _LONGEST) / c.TIME_STEP)
            self._owed = min(self._owed, _LONGEST) - steps * c.TIME_STEP
            if steps:
                self._drive([drives[name] for name in self._names], steps * c.TIME_STEP)
                mujoco.mj_step(self._world.model, self._world.data, nstep=steps)
                if self._away:
                    self._hang()
            return self._motions()

    def pad_forces(self) -> np.ndarray:
        """Normal force of the object on each pad [N], shape (K,), in the order of the hand's pads."""
        with self.lock:
            self._world.refresh()
            return self._world.touch()[0]

    def look(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Joint angles [rad], shape (J,), T_wh and T_wo, shape (4, 4), now."""
        with self.lock:
            self._world.refresh()
            return self._world.joints(), self._world.T_wh(), self._world.T_wo()

    def _drive(self, drives: Sequence[JointDrive], dt: float) -> None:
        """Tell the motors where to go within ``dt`` [s], and how hard they may push."""
        most = np.array([drive.torque * drive.current_cap for drive in drives])
        most = np.minimum(most * TORQUE_PER_AMPERE, c.STALL_TORQUE)
        self._world.model.actuator_forcerange[self._servos] = np.column_stack([-most, most])
        step = dt * np.array([drive.speed for drive in drives])
        goals = np.array([drive.goal for drive in drives])
        self._goals += np.clip(goals - self._goals, -step, step)
        self._world.data.ctrl[self._servos] = self._goals
        self.torque = np.array([drive.torque for drive in drives])

    def _motions(self) -> dict[str, JointMotion]:
        data = self._world.data
        positions = self._world.joints().tolist()
        velocities = data.qvel[self._dofs].tolist()
        currents = (data.actuator_force[self._servos] / TORQUE_PER_AMPERE).tolist()
        values = zip(self._names, positions, velocities, currents, strict=True)
        return {name: JointMotion(*motion) for name, *motion in values}

    def _hang(self) -> None:
        """Undo what gravity did to the object."""
        self._world.data.qpos[self._object : self._object + 3] = AWAY
        self._rest()

    def _rest(self) -> None:
        self._world.data.qvel[self._object_dof : self._object_dof + 6] = 0.0


def _servo_of(model: mujoco.MjModel, joint: str) -> int:
    """Index of the actuator of one of the hand's joints."""
    return int(np.flatnonzero(model.actuator_trnid[:, 0] == model.joint(HAND + joint).id)[0])
