# SPDX-License-Identifier: MIT
"""A hand whose motors another program drives, over ROS 2: joints come as JointState, goals go as JointState.

The joints go through the same inputs as those of ``vtgtsam ros``: several publishers, some of the names each, garbage
refused. Torque is a std_srvs/SetBool service of the driver's. What a driver of motors must see to by itself, heat and
overload, is that program's matter; what this one sees to is that nothing is sent that breaks a limit or jumps, and that
torque goes off where the joints fall silent.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple, Protocol

import numpy as np

from hardware.device import CommandError, HandDevice, HandState
from vtgtsam.exceptions import VtgtsamError
from vtgtsam.live.inputs import Inputs
from vtgtsam.live.recorder import Recorder
from vtgtsam.ros.intake import Intake, joints_intake
from vtgtsam.ros.publisher_clock import PublisherClock

LEAD = 0.3  # [rad], by which a goal may be away from where the joint is
SILENT = 0.5  # [s], joints older than this end everything
FIRST = 5.0  # [s], within which every joint must have spoken


class RosHandError(VtgtsamError):
    """The hand's driver is silent, or does not do what it is told."""


class Topics(NamedTuple):
    """Where the driver is.

    Attributes:
        joints: Its JointState topic.
        goals: The topic on which it takes goals, JointState.
        torque: Its SetBool service.
    """

    joints: str = "/joint_states"
    goals: str = "/joint_goals"
    torque: str = "/torque"


class Link(Protocol):
    """The way to the driver."""

    def send(self, names: Sequence[str], angles: Sequence[float]) -> None:
        """Send goals [rad]."""
        ...

    def set_torque(self, on: bool) -> str:
        """Switch the torque; why that failed, or nothing."""
        ...

    def close(self) -> None:
        """Let go of it."""
        ...


Open = Callable[[Intake], Link]  # begins to hand messages to the intake


class RosHand(HandDevice):
    """A hand behind a ROS 2 driver; a context manager. Methods may be called from any thread.

    Args:
        limits: Least and largest angle of each joint [rad], by name.
        topics: Where the driver is.
        open_link: Opens the way to it; the genuine one where not given.

    Raises:
        RosHandError: Joints do not speak.
    """

    def __init__(
        self,
        limits: Mapping[str, tuple[float, float]],
        topics: Topics | None = None,
        open_link: Open | None = None,
    ) -> None:
        topics = topics or Topics()
        self._limits = dict(limits)
        self._topics = topics
        self._enabled = self._configured = False
        self._torque_known_off = False
        self._lock = threading.RLock()
        clock = PublisherClock(time.time_ns)
        self._inputs = Inputs(self.joint_names, (), clock.now_ns, Recorder(None))
        self._intake = joints_intake(topics.joints, self._inputs, clock)
        self._link = (open_link or _RclpyLink.opener(topics))(self._intake)
        try:
            self._wait_for_joints()
        except BaseException:
            self._link.close()
            raise

    def _wait_for_joints(self) -> None:
        end = time.monotonic() + FIRST
        while missing := self._inputs.joints.missing():
            if time.monotonic() > end:
                raise RosHandError(
                    f"{self._topics.joints} has not told {', '.join(missing)} within {FIRST:.0f} s: does the driver "
                    "run, in this ROS_DOMAIN_ID, and are its joints called so?"
                )
            time.sleep(0.01)

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints."""
        return tuple(self._limits)

    @property
    def limits(self) -> dict[str, tuple[float, float]]:
        """Least and largest angle of each joint [rad], by name."""
        return dict(self._limits)

    @property
    def enabled(self) -> bool:
        """Whether torque is on and commands are taken."""
        return self._enabled

    def configure(self) -> None:
        """Torque off; the driver has set up its motors itself."""
        with self._lock:
            self.off()
            self._configured = True

    def enable(self) -> None:
        """Torque on, with every joint told to stay where it is.

        Raises:
            RosHandError: The hand is not configured, a joint stands outside its limits, or the driver refuses.
        """
        with self._lock:
            if not self._configured:
                raise RosHandError("call configure() before enable()")
            here = self.state().angles
            outside = [n for n, (low, high) in self._limits.items() if not low <= here[n] <= high]
            if outside:
                raise RosHandError(f"{', '.join(outside)} stand outside their limits")
            self._torque_known_off = False
            self._link.send(list(here), list(here.values()))
            if why := self._link.set_torque(True):
                self.off()
                raise RosHandError(f"{self._topics.torque} does not switch the torque on: {why}")
            self._enabled = True

    def state(self) -> HandState:
        """The joints as they were told last.

        Raises:
            RosHandError: They have been silent for too long; torque is off.
        """
        with self._lock:
            ages, positions = self._told()
            if ages.max() > SILENT:
                silent = [n for n, age in zip(self.joint_names, ages, strict=True) if age > SILENT]
                problem = (
                    f"{self._topics.joints} has not told {', '.join(silent)} for {ages.max():.1f} s"
                )
                self._off_after(problem)
                raise RosHandError(f"{problem}: has the driver died?")
            nothing = np.full(len(positions), np.nan)
            now = time.monotonic() - float(ages.min())
            return HandState(
                now,
                self.joint_names,
                positions,
                nothing,
                nothing,
                nothing,
                nothing,
                ages - ages.min(),
            )

    def _told(self) -> tuple[np.ndarray, np.ndarray]:
        """Age of each joint's angle [s], and the angles [rad]."""
        with self._inputs.changed:
            joints, silence = self._inputs.joints, self._inputs.silence("joints")
            newest_ns = joints.latest_ns or 0
            stamps = joints.latest_stamps()
            positions = joints.held(newest_ns)
        behind = np.array([np.inf if s is None else (newest_ns - s) / 1e9 for s in stamps])
        return silence + behind, np.full(len(stamps), np.nan) if positions is None else positions

    def command(self, angles: Mapping[str, float]) -> None:
        """Send goals [rad] by joint name; nothing is sent where one of them breaks a rule.

        Raises:
            CommandError: Torque is off; a name is unknown; an angle is no number, outside its limits, or too far from
                where the joint is.
        """
        with self._lock:
            if not self._enabled:
                raise CommandError("torque is off: call enable() first")
            here = dict(zip(self.joint_names, self._told()[1].tolist(), strict=True))
            for name, angle in angles.items():
                if name not in self._limits:
                    raise CommandError(f"no joint is called {name!r}")
                low, high = self._limits[name]
                if not (math.isfinite(angle) and low <= angle <= high):
                    raise CommandError(
                        f"{name} goes from {low:.2f} to {high:.2f} rad, not to {angle}"
                    )
                if not abs(angle - here[name]) <= LEAD:
                    raise CommandError(
                        f"{name} stands at {here[name]:.2f} rad: {angle:.2f} is further than {LEAD} rad away"
                    )
            self._link.send(list(angles), list(angles.values()))

    def off(self) -> None:
        """Torque off, and the driver's word for it.

        Raises:
            RosHandError: It has not given it.
        """
        with self._lock:
            self._enabled = False
            if why := self._link.set_torque(False):
                raise RosHandError(f"torque not confirmed off: {self._topics.torque}: {why}")
            self._torque_known_off = True

    def _off_after(self, problem: str) -> None:
        try:
            self.off()
        except RosHandError as error:
            raise RosHandError(f"{problem}; {error}") from None

    def close(self) -> None:
        """Torque off unless it is known to be off, and let go of the driver."""
        try:
            if not self._torque_known_off:
                self.off()
        finally:
            self._link.close()

    def remarks(self) -> list[str]:
        """What was wrong with the joints' messages."""
        if not self._intake.unusable:
            return []
        return [
            f"{self._intake.unusable} of {self._intake.messages} messages on {self._topics.joints} could not be used, "
            f"the last one {self._intake.why}"
        ]


class _RclpyLink:
    """The genuine way: a node of its own, spun by a thread."""

    def __init__(self, topics: Topics, intake: Intake) -> None:
        import rclpy
        from rclpy.executors import SingleThreadedExecutor
        from rclpy.qos import qos_profile_sensor_data
        from sensor_msgs.msg import JointState
        from std_srvs.srv import SetBool

        self._context = rclpy.Context()
        rclpy.init(context=self._context)
        self._node = rclpy.create_node("vtgtsam_hand", context=self._context)
        self._node.create_subscription(JointState, topics.joints, intake, qos_profile_sensor_data)
        self._goals = self._node.create_publisher(JointState, topics.goals, 10)
        self._torque = self._node.create_client(SetBool, topics.torque)
        self._executor = SingleThreadedExecutor(context=self._context)
        self._executor.add_node(self._node)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._spin, name="ros hand", daemon=True)
        self._thread.start()

    @classmethod
    def opener(cls, topics: Topics) -> Open:
        """What opens it."""
        return lambda intake: cls(topics, intake)

    def _spin(self) -> None:
        while not self._stop.is_set():
            self._executor.spin_once(timeout_sec=0.05)

    def send(self, names: Sequence[str], angles: Sequence[float]) -> None:
        """Send goals [rad]."""
        from sensor_msgs.msg import JointState

        message = JointState(name=list(names), position=[float(angle) for angle in angles])
        message.header.stamp = self._node.get_clock().now().to_msg()
        self._goals.publish(message)

    def set_torque(self, on: bool) -> str:
        """Switch the torque; why that failed, or nothing."""
        from std_srvs.srv import SetBool

        if not self._torque.wait_for_service(timeout_sec=FIRST):
            return "the service is not there"
        done = threading.Event()
        future = self._torque.call_async(SetBool.Request(data=on))
        future.add_done_callback(lambda _: done.set())
        if not done.wait(FIRST):
            return "no answer"
        answer: Any = future.result()
        return "" if answer.success else answer.message or "it refuses"

    def close(self) -> None:
        """End the node."""
        import rclpy

        self._stop.set()
        self._thread.join(FIRST)
        self._executor.shutdown()
        self._node.destroy_node()
        rclpy.shutdown(context=self._context)
