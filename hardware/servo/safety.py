# SPDX-License-Identifier: MIT
"""What must stop the hand, judged in every cycle, and what it may not be told.

A wrong command is refused, never clipped: it is a mistake.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from hardware.device import CommandError, HandState

from .bus import Bus, BusError, ServoError, SyncRead
from .description import HandDescription, Joint
from .encoders import EncoderWatch
from .setup import describe_error
from .state import StateTracker
from .table import OBEDIENCE

log = logging.getLogger(__name__)

MAX_MISSES = 5  # cycles in a row without an answer
MAX_LOST_GOALS = 3  # cycles in a row in which a servo shows another goal than the last one sent
WARM, HOT = 60.0, 68.0  # [degrees Celsius]; the servo itself stops at 70


@dataclass
class Trouble:
    """Why the hand must stop."""

    alerts: list[Joint] = field(default_factory=list)
    disobedient: list[Joint] = field(default_factory=list)
    silent: list[Joint] = field(default_factory=list)
    stuck: dict[Joint, str] = field(default_factory=dict)
    reasons: list[str] = field(default_factory=list)

    def __bool__(self) -> bool:
        return bool(self.alerts or self.disobedient or self.silent or self.stuck or self.reasons)

    def describe(self, bus: Bus) -> str:
        """In words, after asking the servos concerned; torque should be off by then."""
        self.reasons += [f"{joint.label} does not take its goals" for joint in self.disobedient]
        self.reasons += self.stuck.values()
        words = [_describe_alert(bus, joint.id) for joint in self.alerts] + self.reasons
        if self.silent:
            words.append(_describe_silence(bus, self.silent))
        return "; ".join(words)


class Guard:
    """Judges cycles.

    Attributes:
        lowest: Least supply voltage that each joint's servo has reported [V], by joint name.
        doubts: What was seen of joints that need not be wrong, for people, by joint name.
    """

    def __init__(self, description: HandDescription) -> None:
        joints = description.joints
        self._joints = tuple(joints)
        self._least = [description.model(joint).supply[0] for joint in joints]
        self.lowest = {joint.name: math.inf for joint in joints}
        self.doubts: dict[str, str] = {}
        self._encoders = [EncoderWatch(joint) for joint in joints if description.check_encoders]
        self._lost_goals = [0] * len(joints)
        self._warned: set[int] = set()

    def judge(
        self, read: SyncRead, state: HandState, tracker: StateTracker, sent: Mapping[int, int]
    ) -> Trouble:
        """What is wrong after this cycle.

        Args:
            read: The cycle's answers.
            state: The state made of them.
            tracker: What is known of the joints.
            sent: Goals the servos must show [ticks], by servo id.
        """
        trouble = Trouble()
        for index, joint in enumerate(self._joints):
            answer = read.answers.get(joint.id)
            if answer is not None and answer.alert:
                trouble.alerts.append(joint)
            if tracker.misses[index] >= MAX_MISSES:
                trouble.silent.append(joint)
            if tracker.restarted[index]:
                trouble.reasons.append(
                    f"{joint.label} restarted by itself: is the supply strong enough?"
                )
            if self._goal_lost(index, tracker, sent):
                trouble.disobedient.append(joint)
            self._see_supply(index, float(state.voltages[index]))
            if self._hot(joint, float(state.temperatures[index])):
                trouble.reasons.append(f"{joint.label} is hotter than {HOT:.0f} degrees")
        for index, encoder in enumerate(self._encoders):
            if tracker.misses[index] == 0:
                self._see_encoder(encoder, self._joints[index], read, sent, trouble)
        return trouble

    def _see_encoder(
        self,
        encoder: EncoderWatch,
        joint: Joint,
        read: SyncRead,
        sent: Mapping[int, int],
        trouble: Trouble,
    ) -> None:
        """Add to the trouble where a joint's count is wrong; warn once where it may be."""
        if joint.id not in sent:  # without torque, or never told to move
            encoder.forget()
            return
        answer = read.answers[joint.id]
        values = answer.values
        encoder.see(
            answer.arrived,
            values["present_position"],
            values["goal_position"],
            values["present_current"],
        )
        if encoder.stuck:
            trouble.stuck[joint] = encoder.stuck
        if encoder.doubtful and joint.name not in self.doubts:
            self.doubts[joint.name] = encoder.doubtful
            log.warning("%s", encoder.doubtful)

    def _goal_lost(self, index: int, tracker: StateTracker, sent: Mapping[int, int]) -> bool:
        """Whether a servo has shown another goal than the one sent for too many cycles."""
        if tracker.misses[index] == 0:
            servo_id = self._joints[index].id
            lost = servo_id in sent and tracker.goals[servo_id] != sent[servo_id]
            self._lost_goals[index] = self._lost_goals[index] + 1 if lost else 0
        return self._lost_goals[index] >= MAX_LOST_GOALS

    def _see_supply(self, index: int, volts: float) -> None:
        """Remember the least voltage; warn once where it is too low."""
        joint = self._joints[index]
        if volts < self._least[index] <= self.lowest[joint.name]:
            log.warning(
                "%s has %.1f V, too little: check supply and cables; servos restart below",
                joint.label,
                volts,
            )
        if volts < self.lowest[joint.name]:
            self.lowest[joint.name] = volts

    def _hot(self, joint: Joint, degrees: float) -> bool:
        """Whether it is too hot; warns once before."""
        if degrees >= WARM and joint.id not in self._warned:
            self._warned.add(joint.id)
            log.warning("%s is %.0f degrees warm; it stops at %.0f", joint.label, degrees, HOT)
        return degrees >= HOT


def _describe_alert(bus: Bus, servo_id: int) -> str:
    try:
        return describe_error(bus, servo_id, bus.read(servo_id, "hardware_error_status"))
    except (BusError, ServoError):
        return f"{bus.label(servo_id)} reports a hardware error"


def _describe_silence(bus: Bus, silent: Sequence[Joint]) -> str:
    """Whose silence it is: in a cycle, servos asked after an absent one are silent as well."""
    absent = [joint for joint in silent if not _answers(bus, joint.id)]
    if not absent:
        return f"answers of {_labels(silent)} came damaged or late in {MAX_MISSES} cycles in a row"
    text = f"no answer from {_labels(absent)} in {MAX_MISSES} cycles: check cable and power"
    others = [joint for joint in silent if joint not in absent]
    return f"{text} (it silenced {_labels(others)} as well)" if others else text


def _answers(bus: Bus, servo_id: int) -> bool:
    try:
        bus.ping(servo_id, attempts=2, patience=0.05)
    except BusError:
        return False
    return True


def _labels(joints: Sequence[Joint]) -> str:
    return ", ".join(joint.label for joint in joints)


MAX_AGE = 0.1  # [s], of the position a step is measured from


def disobedience(bus: Bus, joint: Joint, watchdog: float) -> str:
    """Why a servo with torque on would not move as told, or an empty string; asked once, without patience.

    Args:
        bus: The line.
        joint: The servo's joint.
        watchdog: Silence after which it stops by itself [s].
    """
    read = bus.sync_read([joint.id], OBEDIENCE)
    if joint.id not in read.answers:
        return ""
    values = read.answers[joint.id].values
    if values["bus_watchdog"] == -1:
        return (
            f"{joint.label} was stopped by its watchdog, as it had heard nothing for {watchdog:g} s: was this "
            "program paused, or the line interrupted?"
        )
    if not values["torque_enable"]:
        return f"{joint.label} has no torque any more: did another program take it off?"
    return ""


def check_command(
    description: HandDescription, tracker: StateTracker, angles: Mapping[str, float], now: float
) -> None:
    """See that a command breaks no rule.

    Args:
        description: The hand.
        tracker: Where its joints are.
        angles: Commanded angles [rad], by joint name.
        now: Monotonic time [s].

    Raises:
        CommandError: It does; every joint concerned is named.
    """
    names = description.joint_names
    if unknown := sorted(set(angles) - set(names)):
        raise CommandError(f"no joints {', '.join(unknown)}; there are: {', '.join(names)}")
    wrong = []
    for index, joint in enumerate(description.joints):
        if joint.name in angles:
            age, here = tracker.age(index, now), tracker.position(index)
            wrong.append(_wrong(joint, angles[joint.name], here, age, description.max_step))
    if refused := [text for text in wrong if text]:
        raise CommandError("; ".join(refused))


def _wrong(joint: Joint, angle: float, here: float, age: float, max_step: float) -> str:
    """What is wrong with one joint's command, or an empty string."""
    low, high = joint.limits
    if not math.isfinite(angle):
        return f"{joint.label}: {angle} is no angle"
    if not low <= angle <= high:
        return f"{joint.label}: {angle:.3f} rad is outside {low} to {high}"
    if age > MAX_AGE:
        return f"{joint.label}: its position is {age:.2f} s old; call state() before command()"
    if abs(angle - here) > max_step:
        return (
            f"{joint.label}: {angle:.3f} rad is {abs(angle - here):.2f} rad from where it is; at "
            f"most {max_step} are allowed at once"
        )
    return ""
