# SPDX-License-Identifier: MIT
"""Every joint as its servo reports it, whoever is missing; and zeros and signs measured by hand.

For people who bring up a hand: nothing here moves or needs torque.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import yaml

from vtgtsam.atomic import write_text
from vtgtsam.exceptions import VtgtsamError

from .bus import Bus, BusError, NoAnswerError, ServoError
from .description import HandDescription, Joint
from .setup import describe_error, turn_off
from .table import OBEDIENCE, STATE, TICKS_PER_TURN

_TICK = 360.0 / TICKS_PER_TURN  # [degrees]
_PATIENCE = (0.012, 0.05)  # [s], for the first and the second question to a servo
_READS = 10
_STILL = 6  # [ticks], about half a degree, by which a joint that is held still may wander
_LEAST = 15.0  # [degrees] between two marks
_OFF = 0.2  # of the angle between two marks, by which the count may disagree


class JointCalibrationError(VtgtsamError):
    """A joint was not held still, or counts another angle than it was said to be turned by."""


@dataclass(frozen=True)
class JointReading:
    """What one joint's servo reports.

    Attributes:
        joint: The joint.
        count: Its position [ticks]; None where the servo does not answer.
        degrees: Temperature [degrees Celsius].
        volts: Supply [V].
        torque: Whether torque is on.
        note: What is wrong, or an empty string.
    """

    joint: Joint
    count: int | None = None
    degrees: int = 0
    volts: float = 0.0
    torque: bool = False
    note: str = ""

    @property
    def angle(self) -> float:
        """The joint's angle [rad], by the hand's file; NaN where the servo does not answer."""
        return math.nan if self.count is None else self.joint.angle(self.count)


def survey(bus: Bus, description: HandDescription) -> list[JointReading]:
    """One reading of every joint, in the order of the hand's file.

    Raises:
        BusError: The port is gone.
    """
    return [_reading(bus, joint) for joint in description.joints]


def _reading(bus: Bus, joint: Joint) -> JointReading:
    # One by one: in a common question an absent servo would silence those after it.
    for patience in _PATIENCE:
        states = bus.sync_read([joint.id], STATE, patience).answers
        obeys = bus.sync_read([joint.id], OBEDIENCE, patience).answers if states else {}
        if states and obeys:
            break
    else:
        return JointReading(joint, note="no answer")
    values = states[joint.id].values | obeys[joint.id].values
    reading = JointReading(
        joint,
        count=values["present_position"],
        degrees=values["present_temperature"],
        volts=values["present_input_voltage"] / 10,
        torque=bool(values["torque_enable"]),
    )
    notes = []
    if bits := values["hardware_error_status"]:
        notes.append(describe_error(bus, joint.id, bits).split(" reports ")[-1])
    if not joint.limits[0] <= reading.angle <= joint.limits[1]:
        notes.append("outside its limits")
    return JointReading(**{**vars(reading), "note": ", ".join(notes)})


def table(readings: Sequence[JointReading], first: Sequence[JointReading]) -> list[str]:
    """The readings as lines of text; ``first`` are those that movement is counted from."""
    lines = [
        f"{'joint':18} {'id':>3} {'count':>6} {'angle':>8} {'limits':>14} {'moved':>7} {'temp':>5} "
        f"{'supply':>6} {'torque':>6}"
    ]
    for reading, before in zip(readings, first, strict=True):
        joint = reading.joint
        if reading.count is None:
            lines.append(f"{joint.name:18} {joint.id:>3}  {reading.note}")
            continue
        low, high = np.rad2deg(joint.limits)
        moved = np.rad2deg(reading.angle - before.angle)
        moved_text = "" if before.count is None else f"{moved:.1f}°"
        lines.append(
            f"{joint.name:18} {joint.id:>3} {reading.count:>6} {np.rad2deg(reading.angle):>7.1f}° "
            f"{low:>6.0f} to {high:>3.0f}° {moved_text:>7} {reading.degrees:>3}°C {reading.volts:>5.1f}V "
            f"{'ON' if reading.torque else 'off':>6}  {reading.note}".rstrip()
        )
    return lines


def first_of(before: Sequence[JointReading], now: Sequence[JointReading]) -> list[JointReading]:
    """The earlier readings, or the later ones of joints that did not answer before."""
    return [b if b.count is not None else n for b, n in zip(before, now, strict=True)]


def let_go(bus: Bus, description: HandDescription) -> list[str]:
    """Torque off at every servo that answers; the joints whose servos do not.

    Raises:
        TorqueError: A servo that answers may still have torque.
        BusError: No servo answers, or the port is gone.
    """
    bus.sync_write("torque_enable", {joint.id: 0 for joint in description.joints})
    silent = [joint for joint in description.joints if not _answers(bus, joint.id)]
    there = [joint.id for joint in description.joints if joint not in silent]
    if not there:
        raise BusError(
            f"no servo answers on {bus.path} at {bus.baud} baud: if torque may be on, cut the power; "
            "`python -m hardware check` looks for servos"
        )
    turn_off(bus, there, description.patience)
    return [joint.label for joint in silent]


def _answers(bus: Bus, servo_id: int) -> bool:
    try:
        bus.ping(servo_id, attempts=2, patience=0.1)
    except NoAnswerError:
        return False
    return True


def restart(bus: Bus, description: HandDescription, names: Sequence[str] = ()) -> list[str]:
    """Restart the servos of some joints, or of those with a hardware error; what was done, a line each.

    A servo that restarts has no torque, and the hand must be configured again (``run`` does).

    Raises:
        VtgtsamError: A name is unknown, a servo does not come back, or its error stays.
    """
    by_name = {joint.name: joint for joint in description.joints}
    if unknown := [name for name in names if name not in by_name]:
        raise ServoError(f"no joints {', '.join(unknown)}; there are: {', '.join(by_name)}")
    errors = {}
    for joint in [by_name[name] for name in names] or description.joints:
        read = bus.sync_read([joint.id], OBEDIENCE, patience=0.05).answers
        if joint.id in read:
            errors[joint.name] = read[joint.id].values["hardware_error_status"]
    chosen = list(names) or [name for name, bits in errors.items() if bits]
    lines = []
    for name in chosen:
        servo_id = by_name[name].id
        before = (
            describe_error(bus, servo_id, errors[name]) if errors.get(name) else bus.label(servo_id)
        )
        bus.reboot(servo_id)
        bus.ping(servo_id, attempts=10)
        if bits := bus.read(servo_id, "hardware_error_status"):
            raise ServoError(
                f"{describe_error(bus, servo_id, bits)} again after its restart: find the cause"
            )
        lines.append(f"{before}: restarted")
    return lines


@dataclass(frozen=True)
class JointWizard:
    """The measurement of zeros and signs as a conversation; torque must be off.

    Attributes:
        joints: The joints to measure.
        count: The present count of a joint's servo [ticks].
        ask: Shows a question and returns what the person types.
        say: Shows a line.
        positive: What a positive angle does, by joint name, where that is known.
    """

    joints: Sequence[Joint]
    count: Callable[[Joint], int]
    ask: Callable[[str], str]
    say: Callable[[str], None]
    positive: Mapping[str, str]

    def run(self) -> dict[str, Joint]:
        """Each joint with measured zero and sign, by name; those that the person skipped are left out.

        Raises:
            VtgtsamError: The person gave up.
        """
        self.say(
            "Torque is off. Hold each joint at two marks and say at which angle it is, in degrees by the hand's "
            "model. Enter takes the angle in brackets, 's' skips a joint, 'q' gives up."
        )
        found = {}
        for number, joint in enumerate(self.joints, start=1):
            measured = self._measure(f"[{number}/{len(self.joints)}] {joint.label}", joint)
            if measured is not None:
                found[joint.name] = measured
                self.say(
                    f"  zero {measured.zero} (was {joint.zero}), sign {measured.sign:+d} (was {joint.sign:+d})"
                )
        return found

    def _measure(self, title: str, joint: Joint) -> Joint | None:
        high = float(math.floor(np.rad2deg(joint.limits[1])))  # what is shown is what is taken
        sense = f", which {self.positive[joint.name]}" if joint.name in self.positive else ""
        while True:
            try:
                first = self._mark(f"{title}: hold it at a mark; angle", 0.0, joint)
                if first is None:
                    return None
                second = self._mark(f"{title}: turn it the positive way{sense}; angle", high, joint)
                if second is None:
                    return None
                return _fit(joint, first, second)
            except JointCalibrationError as error:
                self.say(f"{error}. Once more, or 's' to skip it.")

    def _mark(self, question: str, usual: float, joint: Joint) -> tuple[float, float] | None:
        """An angle [degrees] and the count there; None to skip the joint."""
        while True:
            typed = self.ask(f"{question} [{usual:.0f}]: ").strip().lower()
            if typed == "q":
                raise _GivenUp("the calibration was given up, nothing is written")
            if typed == "s":
                return None
            try:
                angle = float(typed) if typed else usual
            except ValueError:
                angle = math.nan
            if math.isfinite(angle):
                break
            self.say(f"  an angle in degrees, 's' or 'q' is expected, not {typed!r}")
        counts = [self.count(joint) for _ in range(_READS)]
        if max(counts) - min(counts) > _STILL:
            raise JointCalibrationError(
                f"{joint.label} moved by {(max(counts) - min(counts)) * _TICK:.1f} degrees while it was read: "
                "hold it still"
            )
        return angle, float(np.median(counts))


class _GivenUp(VtgtsamError):
    """The person has had enough."""


def _fit(joint: Joint, first: tuple[float, float], second: tuple[float, float]) -> Joint:
    """The joint with the zero and sign that two marks give, each an angle [degrees] and a count."""
    turned = second[0] - first[0]
    counted = (second[1] - first[1] + TICKS_PER_TURN / 2) % TICKS_PER_TURN - TICKS_PER_TURN / 2
    if abs(turned) < _LEAST:
        raise JointCalibrationError(
            f"the two marks are {abs(turned):.0f} degrees apart: {_LEAST:.0f} or more are needed to tell the sign"
        )
    if abs(abs(counted) * _TICK - abs(turned)) > _OFF * abs(turned):
        raise JointCalibrationError(
            f"{joint.label} counts {abs(counted) * _TICK:.0f} degrees between marks {abs(turned):.0f} degrees apart: "
            "is it this joint that was turned, and all the way?"
        )
    sign = 1 if counted * turned > 0 else -1
    zeros = [count - sign * angle / _TICK for angle, count in (first, second)]
    apart = (zeros[1] - zeros[0] + TICKS_PER_TURN / 2) % TICKS_PER_TURN - TICKS_PER_TURN / 2
    zero = round(zeros[0] + apart / 2) % TICKS_PER_TURN
    return joint.model_copy(update={"zero": zero, "sign": sign})


def moved_zeros(joints: Sequence[Joint], offsets: Mapping[str, float]) -> dict[str, Joint]:
    """Joints, by name, with their zeros where the joints really are at zero; those not named are left out.

    Args:
        joints: The hand's joints.
        offsets: By how much each joint reads too much, dq = q_measured - q_true [rad], by name.

    Raises:
        JointCalibrationError: The hand has no joint of one of these names.
    """
    known = {joint.name: joint for joint in joints}
    if unknown := sorted(set(offsets) - set(known)):
        raise JointCalibrationError(
            f"the hand's file has no joints {', '.join(unknown)}; there are: {', '.join(known)}"
        )
    moved = {}
    for name, offset in offsets.items():
        joint = known[name]
        count = joint.zero + joint.sign * np.rad2deg(offset) / _TICK
        moved[name] = joint.model_copy(update={"zero": round(count) % TICKS_PER_TURN})
    return moved


def with_zeros(text: str, joints: Mapping[str, Joint]) -> str:
    """A hand's YAML text with these joints' zeros and signs, all else as it was, comments too.

    Args:
        text: The file's text.
        joints: Joints by name, from whatever measured them.

    Raises:
        ValueError: The text has no entry of one of these joints.
    """
    spans: list[tuple[int, int, str]] = []
    found = set()
    root = yaml.compose(text)
    top = () if root is None else root.value
    entries = next((value for key, value in top if key.value == "joints"), None)
    for entry in entries.value if entries is not None else ():
        fields = {key.value: value for key, value in entry.value}
        joint = joints.get(str(fields["name"].value))
        if joint is None:
            continue
        found.add(joint.name)
        for field in ("zero", "sign"):
            node = fields[field]
            old = text[node.start_mark.index : node.end_mark.index]
            new = str(getattr(joint, field)).rjust(len(old))
            spans.append((node.start_mark.index, node.end_mark.index, new))
    if missing := set(joints) - found:
        raise ValueError(f"no entries of joints {', '.join(sorted(missing))}")
    for start, end, new in sorted(spans, reverse=True):
        text = text[:start] + new + text[end:]
    return text


def save_zeros(source: Path, path: Path, joints: Mapping[str, Joint]) -> None:
    """Write the hand's file ``source`` with these joints' zeros and signs to ``path``."""
    write_text(path, with_zeros(source.read_text(encoding="utf-8"), joints))
