# SPDX-License-Identifier: MIT
"""The hand as joints in radians, and the rules that keep fingers and servos whole.

    with Hand(load_description("isyhand"), "/dev/serial/by-id/...") as hand:
        hand.configure()
        hand.enable()
        while closing:
            state = hand.state()
            hand.command({"index_proximal": state.angles["index_proximal"] + 0.02})

Torque goes off on the way out of the block, whatever the reason, and as soon as a cycle shows a
servo in trouble. Against what Python cannot see (kill -9, a hang, a pulled cable) every servo has
its own watchdog. SIGTERM ends Python without leaving the block: see ``hardware.stop_signals``.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterable, Mapping
from typing import NoReturn

from hardware.device import CommandError, HandDevice, HandState

from . import safety, setup
from .bus import Bus, BusError, NoAnswerError, ServoError, SyncRead, TorqueError
from .description import HandDescription
from .safety import MAX_MISSES, Guard, Trouble
from .state import StateTracker
from .table import STATE

SLOWEST = 0.02  # [s], a cycle of the loop at 50 Hz
_POLL = 5  # cycles, after which the next servo is asked whether it still obeys
_OUTSIDE = 0.1  # [rad], how far outside its limits a joint may stand when torque goes on
_BOOT_ATTEMPTS = 10  # pings of 0.2 s; a servo restarts in about 0.3 s


class Hand(HandDevice):
    """A hand's servos behind a port; a context manager. Methods may be called from any thread.

    Args:
        description: The built hand.
        path: Its serial port.

    Raises:
        BusError: The port cannot be opened, or servos are missing or of another kind.
    """

    def __init__(self, description: HandDescription, path: str) -> None:
        self.description = description
        self._joints = {joint.name: joint for joint in description.joints}
        self._ids = [joint.id for joint in description.joints]
        self._lock = threading.RLock()
        self._guard = Guard(description)
        self._tracker = StateTracker(description.joints, description.check_clocks)
        self._configured = False
        self._enabled = False
        self._torque_known_off = False  # another program may have left it on
        self._cycles = 0
        self._sent: dict[int, int] = {}  # goals [ticks] that the servos must show, by servo id
        names = {joint.id: joint.name for joint in description.joints}
        self.bus = Bus(path, description.baud, names)
        try:
            setup.check_servos(self.bus, description)
        except BaseException:
            self.bus.close()
            raise

    @property
    def joint_names(self) -> tuple[str, ...]:
        """Names of the joints, in the order of all arrays."""
        return self.description.joint_names

    @property
    def limits(self) -> dict[str, tuple[float, float]]:
        """Least and largest angle of each joint [rad], by name."""
        return {joint.name: joint.limits for joint in self.description.joints}

    @property
    def enabled(self) -> bool:
        """Whether torque is on and commands are taken."""
        return self._enabled

    def close(self) -> None:
        """Torque off unless it is known to be off, and the port closed."""
        try:
            if not self._torque_known_off:
                self.off()
        finally:
            self.bus.close()

    def configure(self) -> None:
        """Torque off; modes, gains, caps and limits as the description has them.

        Raises:
            ServoError: A servo reports a hardware error or does not keep a value.
        """
        with self._lock:
            self.off()
            self._configured = False
            setup.configure(self.bus, self.description)
            self._tracker.forget_clocks()
            self._configured = True

    def enable(self) -> None:
        """Torque on, with every joint told to stay where it is.

        Raises:
            ServoError: The hand is not configured, or a joint stands outside its limits.
        """
        with self._lock:
            if not self._configured:
                raise ServoError("call configure() before enable()")
            self._refuse_slow_line()
            self._check_standing(self._complete_state())
            self._torque_known_off = False
            try:
                setup.turn_on(self.bus, self._ids, self.description.watchdog)
            except BaseException:
                self.off()
                raise
            self._enabled = True

    def state(self) -> HandState:
        """Read all joints, once; a servo that does not answer keeps its last values and ages.

        Raises:
            ServoError: A servo is in trouble, or silent for five cycles; torque is off everywhere.
            BusError: The port is gone; a TorqueError where torque may still be on.
        """
        with self._lock:
            try:
                read = self.bus.sync_read(self._ids, STATE, self.description.patience)
            except BusError as error:
                self._off_after(error)
                raise
            state = self._tracker.update(read)
            if any(state.ages[k] > 0 for k in self._answered(read)) or self._goals_differ():
                self.bus.distrust()  # else every later cycle would get the answers of the one before
            trouble = self._guard.judge(read, state, self._tracker, self._sent)
            self._see_obedience(trouble)
            if trouble:
                self._stop(trouble)
            return state

    def _answered(self, read: SyncRead) -> list[int]:
        """Places of the joints whose servos answered, in time or not."""
        return [k for k, servo_id in enumerate(self._ids) if servo_id in read.answers]

    def _goals_differ(self) -> bool:
        """Whether a servo shows another goal than the last one sent."""
        return any(self._tracker.goals.get(i, goal) != goal for i, goal in self._sent.items())

    def command(self, angles: Mapping[str, float]) -> None:
        """Send goal positions. Nothing is sent where one of them breaks a rule.

        Args:
            angles: Angles [rad], by joint name; those left out keep their goals.

        Raises:
            CommandError: Torque is off; a name is unknown; an angle is no number, outside its
                limits, or too far from where the joint is; or that is known too long ago (0.1 s).
        """
        with self._lock:
            if not self._enabled:
                raise CommandError("torque is off: call enable() first")
            safety.check_command(self.description, self._tracker, angles, time.monotonic())
            goals = {
                joint.id: joint.ticks(angles[joint.name], int(turns))
                for joint, turns in zip(self.description.joints, self._tracker.turns, strict=True)
                if joint.name in angles
            }
            self.bus.sync_write("goal_position", goals)
            self._sent |= goals

    def off(self) -> None:
        """Torque off everywhere, and see that it is.

        Raises:
            TorqueError: It is not certain for some joints; they are named.
        """
        with self._lock:
            self._enabled = False
            self._sent.clear()
            patience = self.description.patience
            try:
                setup.turn_off(self.bus, self._ids, patience)
            except (KeyboardInterrupt, SystemExit):  # a signal must not stop this halfway
                setup.turn_off(self.bus, self._ids, patience)
                raise
            self._torque_known_off = True

    def reboot(self, names: Iterable[str]) -> None:
        """Restart servos after a hardware error; the hand must then be configured anew.

        Raises:
            NoAnswerError: A servo did not come back.
        """
        with self._lock:
            self.off()
            self._configured = False
            ids = [self._joints[name].id for name in names]
            for servo_id in ids:
                self.bus.reboot(servo_id)
            for servo_id in ids:
                self.bus.ping(servo_id, attempts=_BOOT_ATTEMPTS)

    def remarks(self) -> list[str]:
        """Answers that were lost, servos whose supply was too weak, joints that stopped dead."""
        lines = []
        if diagnosis := self.bus.traffic.diagnosis(self.bus.label):
            lines.append(diagnosis)
        lowest = self._guard.lowest
        weak = [
            f"{joint.label} {lowest[joint.name]:.1f} V"
            for joint in self.description.joints
            if lowest[joint.name] < self.description.model(joint).supply[0]
        ]
        if weak:
            lines.append(f"supply too weak at times: {', '.join(weak)}; check supply and cables")
        return [*lines, *self._guard.doubts.values()]

    def _refuse_slow_line(self) -> None:
        """ServoError where a cycle takes longer on the line than the loop has."""
        if (cycle := self.description.cycle) > SLOWEST:
            raise ServoError(
                f"at {self.description.baud} baud a cycle of {len(self._ids)} servos takes {1000 * cycle:.0f} ms, at "
                f"most {1000 * SLOWEST:.0f} ms are allowed: set the servos to 1000000 baud or more (Dynamixel "
                "Wizard), and `baud` in the hand's file as well"
            )

    def _see_obedience(self, trouble: Trouble) -> None:
        """Add to the trouble what servos under torque say of watchdog and torque.

        Those that show other goals than theirs, or stand although told to move, are asked at once, the others in turn.
        """
        if not self._enabled:
            return
        asked = [*trouble.disobedient, *trouble.stuck][:1]
        self._cycles += 1
        if not asked and self._cycles % _POLL == 0:
            joints = self.description.joints
            asked = [joints[self._cycles // _POLL % len(joints)]]
        for joint in asked:
            if why := safety.disobedience(self.bus, joint, self.description.watchdog):
                trouble.reasons.append(why)
                trouble.disobedient.clear()
                trouble.stuck.clear()

    def _complete_state(self) -> HandState:
        """A state in which every joint has just answered."""
        for _ in range(MAX_MISSES):
            state = self.state()
            if not state.ages.any():
                return state
        raise NoAnswerError(f"not all joints answered in any of {MAX_MISSES} cycles")

    def _check_standing(self, state: HandState) -> None:
        """ServoError where a joint stands where no joint of this hand can."""
        wrong = []
        for joint, angle in zip(self.description.joints, state.positions, strict=True):
            low, high = joint.limits
            if not low - _OUTSIDE <= angle <= high + _OUTSIDE:
                wrong.append(f"{joint.label} stands at {angle:.2f} rad, limits {low} to {high}")
        if wrong:
            raise ServoError(
                f"{'; '.join(wrong)}: move it by hand, or correct sign and zero in the hand's file "
                "(`python -m hardware joints` shows the counts, `calibrate-joints` measures them)"
            )

    def _stop(self, trouble: Trouble) -> NoReturn:
        """Torque off first, then say why."""
        self._configured = False
        try:
            self.off()
        except TorqueError as error:
            raise TorqueError(f"{trouble.describe(self.bus)}; {error}") from error
        raise ServoError(f"{trouble.describe(self.bus)}; torque is off")

    def _off_after(self, cause: BusError) -> None:
        """Torque off after an error of the line; TorqueError that says both where it is not certain."""
        if not self._torque_known_off:
            try:
                self.off()
            except TorqueError as error:
                raise TorqueError(f"{cause}; {error}") from cause
