# SPDX-License-Identifier: MIT
"""The servos' thread: read the joints, tell the fingers where to go, 50 times a second.

The motion is the simulator's controller (``vtgtsam.grasp``). Before it begins, the hand is opened at the
same speed and with the same lead over the measured angles.
"""

from __future__ import annotations

import logging
import threading
from enum import Enum

import numpy as np

from hardware.servo.bus import CommandError
from hardware.servo.hand import Hand
from hardware.servo.state import HandState
from vtgtsam.grasp import GraspController, GraspDescription
from vtgtsam.grasp.controller import CLOSED, LEAD
from vtgtsam.grasp.controller import RATE as GROWTH

from .recorder import Recorder
from .streams import RunClock, Streams, may_move
from .threads import Ticker

log = logging.getLogger(__name__)

RATE = 50.0  # [Hz]
OPEN = (
    0.1  # [rad], a joint so near its start counts as there; friction keeps it from getting nearer
)


class Phase(Enum):
    """What the fingers do."""

    OPENING = "opening"
    OPEN = "open"
    CLOSING = "closing"
    CLOSED = "holding"


class Fingers:
    """Moves a hand's fingers and keeps its joints' slot filled.

    Attributes:
        phase: What they do now.
        waits: Ticks in which they had to wait because a stream was too old.
        state: The last state of the joints.
    """

    def __init__(
        self,
        hand: Hand,
        grasp: GraspDescription,
        streams: Streams,
        clock: RunClock,
        recorder: Recorder,
    ) -> None:
        """Nothing moves before ``run``.

        Args:
            hand: The hand with torque on.
            grasp: How it grasps.
            streams: Where the joints go.
            clock: The run's clock.
            recorder: Gets the joints.
        """
        self._hand = hand
        self._streams = streams
        self._clock = clock
        self._recorder = recorder
        self._limits = np.array([joint.limits for joint in hand.description.joints])
        self._controller = GraspController(grasp, hand.joint_names, self._limits)
        self._start = np.clip(self._controller.command, *self._limits.T)
        self._began_ns = 0
        self._moved_ns: int | None = None
        self._opening: np.ndarray | None = None
        self.ticker = Ticker(RATE)
        self.phase = Phase.OPENING
        self.waits = 0
        self.state: HandState | None = None

    def close(self) -> None:
        """Begin the grasp."""
        self._began_ns = self._clock.now_ns()
        self.phase = Phase.CLOSING

    def not_there(self) -> str:
        """Which joints are not where an open hand has them."""
        if self.state is None:
            return "no joint was read"
        joints = zip(self.state.joint_names, self.state.positions, self._start, strict=True)
        return ", ".join(
            f"{name} stands at {here:.2f} rad instead of {there:.2f}"
            for name, here, there in joints
            if not abs(here - there) < OPEN
        )

    def run(self, stop: threading.Event) -> None:
        """Read and move until ``stop`` is set."""
        self.ticker = Ticker(RATE)
        while self.ticker.wait(stop):
            self._cycle()

    def _cycle(self) -> None:
        state = self.state = self._hand.state()
        if not np.isfinite(state.positions).all():  # a servo that has not answered yet
            return
        instant_ns = self._clock.instant_ns(state.time)
        self._streams.put(
            "joints",
            instant_ns,
            state.positions,
            lambda: self._recorder.write(
                "joint_states", instant_ns, state.joint_names, state.positions
            ),
        )
        self._move(state.positions)

    def _move(self, joints: np.ndarray) -> None:
        now_ns = self._clock.now_ns()
        dt = 0.0 if self._moved_ns is None else (now_ns - self._moved_ns) / 1e9
        self._moved_ns = now_ns
        if self.phase is Phase.CLOSING and not self._may_close(now_ns):
            self.waits += 1
            self._began_ns += round(dt * 1e9)  # the grasp's time stands still as well
            return
        try:
            self._hand.command(self._goals(joints, now_ns, min(dt, 2 / RATE)))
        except CommandError as error:  # the fingers stay where they were told to be before
            self.waits += 1
            log.info("fingers wait: %s", error)

    def _may_close(self, now_ns: int) -> bool:
        ages = {name: self._streams.age(name, now_ns) for name in ("joints", "pads")}
        return may_move(ages)

    def _goals(self, joints: np.ndarray, now_ns: int, dt: float) -> np.ndarray:
        if self.phase is Phase.OPENING:
            goals = self._towards_start(joints, dt)
            if np.abs(joints - self._start).max() < OPEN:
                self.phase = Phase.OPEN
            return goals
        if self.phase is Phase.OPEN:
            return np.clip(self._start, joints - LEAD, joints + LEAD)
        since = (now_ns - self._began_ns) / 1e9
        if since >= CLOSED:
            self.phase = Phase.CLOSED
        goals = self._controller.step(since, dt, joints)
        # A finger may be pushed away from its goal by more than a command may lead.
        return np.clip(np.clip(goals, joints - LEAD, joints + LEAD), *self._limits.T)

    def _towards_start(self, joints: np.ndarray, dt: float) -> np.ndarray:
        """Where to go to open the hand: from where it is by at most the lead."""
        if self._opening is None:
            self._opening = joints.copy()
        step = GROWTH * dt
        self._opening = self._opening + np.clip(self._start - self._opening, -step, step)
        goals = np.clip(self._opening, joints - LEAD, joints + LEAD)
        return np.clip(goals, *self._limits.T)
