# SPDX-License-Identifier: MIT
"""The hand's thread: read the joints, tell the fingers where to go, 50 times a second.

The motion is the simulator's controller (``vtgtsam.grasp``). Before it begins, the hand is opened at the
same speed and with the same lead over the measured angles, and every joint is tried: told to move a little, it must
be read to have moved. A servo whose encoder is stuck, whose horn is loose or whose finger is caught would else be
believed to stand where it stood.

The driver's joints and the model's go by name; arrays here are in the model's order.
"""

from __future__ import annotations

import logging
import threading
from enum import Enum

import numpy as np

from hardware.device import CommandError, HandDevice, HandState
from vtgtsam import HandModel
from vtgtsam.exceptions import LiveError
from vtgtsam.grasp import GraspController, GraspDescription
from vtgtsam.grasp.controller import CLOSED, LEAD
from vtgtsam.grasp.controller import RATE as GROWTH
from vtgtsam.live.clock import RunClock
from vtgtsam.live.inputs import Inputs
from vtgtsam.live.threads import Ticker

from .ages import ages, may_move

log = logging.getLogger(__name__)

RATE = 50.0  # [Hz]
OPEN = (
    0.1  # [rad], a joint so near its start counts as there; friction keeps it from getting nearer
)
TRIED = 0.2  # [rad], by which every joint is told to move before it is believed ...
MOVED = 0.05  # [rad], ... and by which it must be read to have moved
TRIAL = 1.5  # [s], for that


class Phase(Enum):
    """What the fingers do."""

    OPENING = "opening"
    TRYING = "trying the joints"
    OPEN = "open"
    CLOSING = "closing"
    CLOSED = "holding"


class Fingers:
    """Moves a hand's fingers and keeps its joints' stream filled.

    Attributes:
        phase: What they do now.
        waits: Ticks in which they had to wait because a stream was too old.
        state: The last state of the joints.
        joints: The last angles in the model's order [rad], shape (J,); None before the first.
    """

    def __init__(
        self,
        device: HandDevice,
        hand: HandModel,
        grasp: GraspDescription,
        inputs: Inputs,
        clock: RunClock,
    ) -> None:
        """Nothing moves before ``run``.

        Args:
            device: The hand with torque on.
            hand: Its model.
            grasp: How it grasps.
            inputs: Where the joints go.
            clock: The run's clock.
        """
        self._device = device
        self._hand = hand
        self._inputs = inputs
        self._clock = clock
        limits = device.limits
        self._limits = np.array([limits.get(n, (-np.pi, np.pi)) for n in hand.joint_names])
        self._driven = np.array([name in limits for name in hand.joint_names])
        self._controller = GraspController(grasp, hand.joint_names, self._limits)
        self._start: np.ndarray = np.clip(self._controller.command, *self._limits.T)
        self._trial: np.ndarray = self._start + TRIED * self._directions(grasp)
        self._tried = False
        self._least = self._most = np.zeros(0)
        self._began_ns = 0
        self._moved_ns: int | None = None
        self._opening: np.ndarray | None = None
        self.ticker = Ticker(RATE)
        self.phase = Phase.OPENING
        self.waits = 0
        self.state: HandState | None = None
        self.joints: np.ndarray | None = None

    def close(self) -> None:
        """Begin the grasp."""
        self._began_ns = self._clock.now_ns()
        self.phase = Phase.CLOSING

    def not_there(self) -> str:
        """Which joints are not where an open hand has them."""
        if self.joints is None:
            return "no joint was read"
        joints = zip(self._hand.joint_names, self.joints, self._start, self._driven, strict=True)
        return ", ".join(
            f"{name} stands at {here:.2f} rad instead of {there:.2f}"
            for name, here, there, driven in joints
            if driven and not abs(here - there) < OPEN
        )

    def run(self, stop: threading.Event) -> None:
        """Read and move until ``stop`` is set."""
        self.ticker = Ticker(RATE)
        while self.ticker.wait(stop):
            self._cycle()

    def _directions(self, grasp: GraspDescription) -> np.ndarray:
        """Where each joint has room to be tried: closing joints close, others turn to their wider side."""
        wider = np.where(self._limits.sum(axis=1) >= 2 * self._start, 1.0, -1.0)
        closing = np.array([grasp.sign(name) for name in self._hand.joint_names])
        closes = np.array([name in grasp.ranks() for name in self._hand.joint_names])
        return np.where(closes, closing, wider)

    def _cycle(self) -> None:
        state = self.state = self._device.state()
        if not np.isfinite(state.positions).all():  # a servo that has not answered yet
            return
        joints = self.joints = self._hand.joint_array(state.angles)
        instant_ns = self._clock.instant_ns(state.time)
        self._inputs.put_joints(instant_ns, self._hand.joint_names, joints.tolist())
        self._move(joints)

    def _move(self, joints: np.ndarray) -> None:
        now_ns = self._clock.now_ns()
        dt = 0.0 if self._moved_ns is None else (now_ns - self._moved_ns) / 1e9
        self._moved_ns = now_ns
        if self.phase is Phase.CLOSING and not may_move(ages(self._inputs, now_ns)):
            self.waits += 1
            self._began_ns += round(dt * 1e9)  # the grasp's time stands still as well
            return
        goals = self._goals(joints, now_ns, min(dt, 2 / RATE))
        # A finger may be pushed away from its goal by more than a command may lead.
        goals = np.clip(np.clip(goals, joints - LEAD, joints + LEAD), *self._limits.T)
        named = zip(self._hand.joint_names, goals.tolist(), self._driven, strict=True)
        try:
            self._device.command({name: goal for name, goal, driven in named if driven})
        except CommandError as error:  # the fingers stay where they were told to be before
            self.waits += 1
            log.info("fingers wait: %s", error)

    def _goals(self, joints: np.ndarray, now_ns: int, dt: float) -> np.ndarray:
        if self.phase is Phase.OPENING:
            goals = self._towards_start(joints, dt)
            if np.abs(joints - self._start)[self._driven].max() < OPEN:
                self._opened(joints, now_ns)
            return goals
        if self.phase is Phase.TRYING:
            self._try(joints, now_ns)
            return self._trial
        if self.phase is Phase.OPEN:
            return self._start
        since = (now_ns - self._began_ns) / 1e9
        if since >= CLOSED:
            self.phase = Phase.CLOSED
        return self._controller.step(since, dt, joints)

    def _opened(self, joints: np.ndarray, now_ns: int) -> None:
        """The hand is open: try its joints, or go on where that was done."""
        self.phase = Phase.OPEN if self._tried else Phase.TRYING
        self._began_ns = now_ns
        self._least, self._most = joints.copy(), joints.copy()
        self._opening = None

    def _try(self, joints: np.ndarray, now_ns: int) -> None:
        """LiveError where a joint did not move although it was told to for long enough."""
        self._least, self._most = np.minimum(self._least, joints), np.maximum(self._most, joints)
        still = self._driven & (self._most - self._least < MOVED)
        if not still.any():
            self.phase, self._tried = Phase.OPENING, True
        elif now_ns - self._began_ns > TRIAL * 1e9:
            names = [n for n, held in zip(self._hand.joint_names, still, strict=True) if held]
            raise LiveError(
                f"told to move by {TRIED} rad, {', '.join(names)} reads as if it stood still: is it caught, its horn "
                "loose, or its encoder stuck? `python -m hardware joints` shows what it reads when moved by hand"
            )

    def _towards_start(self, joints: np.ndarray, dt: float) -> np.ndarray:
        """Where to go to open the hand: from where it is by at most the lead."""
        if self._opening is None:
            self._opening = joints.copy()
        step = GROWTH * dt
        self._opening = self._opening + np.clip(self._start - self._opening, -step, step)
        return self._opening
