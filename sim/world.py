# SPDX-License-Identifier: MIT
"""The simulated world while it runs: place the object, command the joints, step, sense."""

from __future__ import annotations

import mujoco
import numpy as np

from vtgtsam import HandModel, ObjectModel
from vtgtsam.grasp import GraspDescription

from .scene import HAND, OBJECT, WRIST, build, pad_geom


class World:
    """A hand and an object, compiled once, to be simulated from many placements.

    Attributes:
        description: How the hand grasps.
        hand: The hand; joints and pads below are in its order.
        obj: The object.
        model: The MuJoCo scene.
        data: Its state now. ``refresh`` before its contacts or body poses are read.
        start: Angles of the open hand [rad], shape (J,).
        limits: Lower and upper limit of each joint [rad], shape (J, 2).
        on_fingers: Whether each pad moves when the hand closes, shape (K,).
    """

    def __init__(
        self,
        description: GraspDescription,
        hand: HandModel,
        obj: ObjectModel,
        friction: str = "paper",
    ) -> None:
        """Build the scene.

        Args:
            description: How the hand grasps.
            hand: The hand.
            obj: The object.
            friction: One of ``constants.FRICTION``.

        Raises:
            HandError: The description does not fit the hand.
        """
        self.description, self.hand, self.obj = description, hand, obj
        self.model = build(description, hand, obj, friction)
        self.data = mujoco.MjData(self.model)
        self.start = np.array([description.start.get(name, 0.0) for name in hand.joint_names])
        limited = hand.model.jnt_limited.astype(bool)[:, None]
        self.limits = np.where(limited, hand.model.jnt_range, (-np.pi, np.pi))
        self.on_fingers = np.array([self._closes(pad) for pad in hand.pad_bodies])
        self._index()

    def _closes(self, body: int) -> bool:
        """Whether a joint that closes the hand lies between its root and a body of the hand."""
        model, closing = self.hand.model, self.description.ranks()
        while body:
            first, count = model.body_jntadr[body], model.body_jntnum[body]
            if any(self.hand.joint_names[j] in closing for j in range(first, first + count)):
                return True
            body = model.body_parentid[body]
        return False

    def _index(self) -> None:
        """Where in MuJoCo's arrays joints, servos and pads are."""
        model, names = self.model, self.hand.joint_names
        self._qpos = np.array([model.joint(HAND + name).qposadr[0] for name in names])
        self._object_qpos = int(model.joint(OBJECT).qposadr[0])
        self._object_dof = int(model.joint(OBJECT).dofadr[0])
        servo_joints = model.actuator_trnid[:, 0]
        self._wrist_servo = int(np.flatnonzero(servo_joints == model.joint(WRIST).id)[0])
        joint_ids = [model.joint(HAND + name).id for name in names]
        self._servos = np.flatnonzero(np.isin(servo_joints, joint_ids))
        self._servo_joints = np.array([joint_ids.index(servo_joints[i]) for i in self._servos])
        self._pad_of_geom = np.full(model.ngeom, -1)
        for k, name in enumerate(self.hand.pad_names):
            self._pad_of_geom[model.geom(pad_geom(name)).id] = k
        self._object_body = model.body(OBJECT).id
        self._object_geoms = model.geom_bodyid == model.body(OBJECT).id

    def place(self, T_wo: np.ndarray) -> None:
        """Open the hand, level it, and put the object at ``T_wo`` (4, 4), everything at rest."""
        mujoco.mj_resetData(self.model, self.data)
        self.data.qpos[self._qpos] = self.start
        pose = self.data.qpos[self._object_qpos : self._object_qpos + 7]
        pose[:3] = T_wo[:3, 3]
        mujoco.mju_mat2Quat(pose[3:], T_wo[:3, :3].ravel())
        self.command(self.start, 0.0)
        self.refresh()

    def command(self, joints: np.ndarray, wrist: float) -> None:
        """Set the servos' goals: joint angles (J,) and the wrist's backward angle [rad]."""
        self.data.ctrl[self._servos] = joints[self._servo_joints]
        self.data.ctrl[self._wrist_servo] = wrist

    def push(self, force_w: np.ndarray) -> None:
        """Pull at the object's centre of mass with a force [N], shape (3,), from now on."""
        self.data.xfrc_applied[self._object_body, :3] = force_w

    def step(self) -> None:
        """Simulate one time step (1 ms)."""
        mujoco.mj_step(self.model, self.data)

    def refresh(self) -> None:
        """Bring contacts, forces and body poses to the instant of the joint angles.

        After a step they lag one step behind.
        """
        mujoco.mj_forward(self.model, self.data)

    def joints(self) -> np.ndarray:
        """Joint angles [rad], shape (J,)."""
        return np.asarray(self.data.qpos[self._qpos])

    def T_wh(self) -> np.ndarray:
        """Pose of the hand, shape (4, 4)."""
        return self._pose(WRIST)

    def T_wo(self) -> np.ndarray:
        """Pose of the object, shape (4, 4)."""
        return self._pose(OBJECT)

    def object_speed(self) -> float:
        """Speed of the object's frame [m/s]."""
        return float(np.linalg.norm(self.data.qvel[self._object_dof : self._object_dof + 3]))

    def touch(self) -> tuple[np.ndarray, np.ndarray]:
        """What the object does to each pad: normal force [N] and overlap [m], each of shape (K,).

        The overlap is NaN for a pad that the object does not touch. Contacts of the hand with itself
        do not count (paper, "Simulation Experiment Setup").
        """
        contact = self.data.contact
        pads = self._pads_touched()
        active = (pads >= 0) & (contact.efc_address >= 0)
        pads = pads[active]
        force = np.zeros(len(self.hand.pads))
        overlap = np.full(len(self.hand.pads), np.nan)
        # Of a contact's rows the first is along its normal, in an elliptic cone.
        np.add.at(force, pads, self.data.efc_force[contact.efc_address[active]])
        np.fmax.at(overlap, pads, -contact.dist[active])
        return force, overlap

    def _pads_touched(self) -> np.ndarray:
        """For each contact the pad that the object touches, or -1."""
        geoms = self.data.contact.geom
        with_object = self._object_geoms[geoms].any(axis=1)
        return np.where(with_object, self._pad_of_geom[geoms].max(axis=1), -1)

    def overlap_with_hand(self) -> float:
        """Deepest overlap of the object with any part of the hand [m]; 0 where there is none."""
        with_object = self._object_geoms[self.data.contact.geom].any(axis=1)
        return float(np.max(-self.data.contact.dist[with_object], initial=0.0))

    def _pose(self, body: str) -> np.ndarray:
        view = self.data.body(body)
        T = np.eye(4)
        T[:3, :3] = view.xmat.reshape(3, 3)
        T[:3, 3] = view.xpos
        return T
