# SPDX-License-Identifier: MIT
"""Bringing servos into the state the hand needs: who is there, which registers hold what, torque on and off."""

from __future__ import annotations

import contextlib
import logging
from collections.abc import Iterable, Mapping, Sequence

from .bus import Bus, BusError, NoAnswerError, ServoError, TorqueError
from .description import HandDescription, Joint
from .table import (
    BAUD_CODES,
    CAREFUL_SHUTDOWN,
    CURRENT_BASED_POSITION,
    HARDWARE_ERRORS,
    MODELS,
    Block,
    from_si,
    model_name,
    register,
)

log = logging.getLogger(__name__)

_ATTEMPTS = 3
_PATIENCE = 0.2  # [s]
_SHORT = 0.05  # [s], where perhaps nobody is there


def check_servos(bus: Bus, description: HandDescription) -> None:
    """See that every joint's servo is there and of the model that the hand's file says.

    Raises:
        BusError: Some are not; all of them are named.
    """
    joints = description.joints
    # A servo set to answer reads only would look as if it ignored every write.
    bus.sync_write("status_return_level", {joint.id: 2 for joint in joints})
    models = _models(bus, joints, attempts=1, patience=_SHORT)
    if not models:
        raise BusError(
            f"no servo answers on {bus.path} at {bus.baud} baud: is the hand's power on, the right "
            "port given, and the baud rate in its file the servos'? `python -m hardware check` looks for them"
        )
    models |= _models(bus, [j for j in joints if j.id not in models], _ATTEMPTS, _PATIENCE)
    silent = [joint.label for joint in joints if joint.id not in models]
    wrong = [f"no answer from {', '.join(silent)}: check their cables and ids"] if silent else []
    if wrong := wrong + wrong_models(description, models):
        raise BusError("; ".join(wrong))


def wrong_models(description: HandDescription, models: Mapping[int, int]) -> list[str]:
    """What to say of servos that are of another model than the hand's file says; a line for each model.

    Args:
        description: The hand.
        models: Model numbers of the servos that answer, by id.
    """
    others: dict[tuple[str, str], list[Joint]] = {}
    for joint in description.joints:
        said = description.model_name(joint)
        if joint.id in models and models[joint.id] != MODELS[said].number:
            others.setdefault((model_name(models[joint.id]), said), []).append(joint)
    lines = []
    for (found, said), joints in others.items():
        whole = len(joints) == len(description.joints)
        who = (
            f"all {len(joints)} servos are"
            if whole
            else f"{', '.join(j.label for j in joints)}: each is"
        )
        if len(joints) == 1:
            who = f"{joints[0].label} is"
        where = "" if whole else " at these joints"
        cure = (
            f"write `servo: {found}`{where} in the hand's file"
            if found in MODELS
            else f"this program knows {', '.join(MODELS)}; is it the right id?"
        )
        lines.append(f"{who} {found}, the hand's file says {said}: {cure}")
    return lines


def _models(bus: Bus, joints: Sequence[Joint], attempts: int, patience: float) -> dict[int, int]:
    """Model numbers of the servos that answer, by id."""
    models = {}
    for joint in joints:
        with contextlib.suppress(NoAnswerError):
            models[joint.id], _ = bus.ping(joint.id, attempts, patience)
    return models


def settings(description: HandDescription) -> dict[str, dict[int, int]]:
    """Counts that registers must have, by register name and servo id, in the order of writing.

    EEPROM comes first: a change of the operating mode resets gains and caps. The current limit is
    the joint's cap as well, so that not even a servo that restarts may draw more.
    """
    joints = description.joints
    caps = {joint.id: from_si("current_limit", joint.current) for joint in joints}

    def everywhere(count: int) -> dict[int, int]:
        return {joint.id: count for joint in joints}

    return {
        "return_delay_time": everywhere(0),
        "drive_mode": everywhere(0),
        "operating_mode": everywhere(CURRENT_BASED_POSITION),
        "secondary_id": everywhere(255),
        "homing_offset": everywhere(
            0
        ),  # zeros are in the hand's file; offsets confuse the watchdog
        "startup_configuration": everywhere(0),
        "shutdown": everywhere(CAREFUL_SHUTDOWN),
        "current_limit": caps,
        "bus_watchdog": everywhere(0),  # ends a trip, which locks goals
        "position_d_gain": {joint.id: joint.gains.D for joint in joints},
        "position_i_gain": {joint.id: joint.gains.I for joint in joints},
        "position_p_gain": {joint.id: joint.gains.P for joint in joints},
        "feedforward_2nd_gain": everywhere(0),
        "feedforward_1st_gain": everywhere(0),
        "goal_current": caps,
        "profile_acceleration": everywhere(0),
        "profile_velocity": everywhere(from_si("profile_velocity", description.max_speed)),
    }


def configure(bus: Bus, description: HandDescription) -> None:
    """Torque off, then write what differs, then read all of it back.

    Raises:
        ServoError: A servo reports a hardware error, refuses a value, or does not keep it.
    """
    ids = [joint.id for joint in description.joints]
    for servo_id in ids:
        bus.write(servo_id, "torque_enable", 0)
    refuse_hardware_errors(bus, ids)
    wanted = settings(description)
    for name, counts in wanted.items():
        _settle(bus, name, read_all(bus, ids, name), counts)
    for name, counts in wanted.items():
        _see(bus, name, read_all(bus, ids, name), counts)


def refuse_hardware_errors(bus: Bus, ids: Sequence[int]) -> None:
    """ServoError that names every servo with a hardware error and what it is."""
    errors = read_all(bus, ids, "hardware_error_status")
    if troubles := [describe_error(bus, i, bits) for i, bits in errors.items() if bits]:
        raise ServoError(f"{'; '.join(troubles)}; find the cause, then reboot it")


def describe_error(bus: Bus, servo_id: int, bits: int) -> str:
    """A servo's hardware error in words."""
    words = [text for bit, text in HARDWARE_ERRORS.items() if bits & 1 << bit] or [f"bits {bits}"]
    return f"{bus.label(servo_id)} reports {' and '.join(words)}"


def read_all(bus: Bus, ids: Sequence[int], name: str) -> dict[int, int]:
    """One register of every servo.

    Raises:
        NoAnswerError: Some did not answer in three attempts; they are named.
    """
    block = Block([name])
    counts: dict[int, int] = {}
    for _ in range(_ATTEMPTS):
        missing = [i for i in ids if i not in counts]
        if not missing:
            break
        read = bus.sync_read(missing, block, patience=_PATIENCE)
        counts |= {i: answer.values[name] for i, answer in read.answers.items()}
    for servo_id in ids:  # an absent servo silences those asked after it
        if servo_id not in counts:
            counts[servo_id] = bus.read(servo_id, name)
    return counts


def _settle(bus: Bus, name: str, present: Mapping[int, int], wanted: Mapping[int, int]) -> None:
    """Write what differs; changes that outlive the power are logged."""
    changed = [i for i, count in present.items() if count != wanted[i]]
    for servo_id in changed:
        bus.write(servo_id, name, wanted[servo_id])
    if changed and register(name).eeprom:
        changes = ", ".join(f"{bus.label(i)} {present[i]} -> {wanted[i]}" for i in changed)
        log.warning("changed %s, also after power off: %s", name, changes)


def _see(bus: Bus, name: str, present: Mapping[int, int], wanted: Mapping[int, int]) -> None:
    wrong = [
        f"{bus.label(i)} has {count} instead of {wanted[i]}"
        for i, count in present.items()
        if count != wanted[i]
    ]
    if wrong:
        raise ServoError(f"{name} did not stay as written: {'; '.join(wrong)}")


_TORQUE = Block(["torque_enable"])
_OFF_ATTEMPTS = 5
_SOON = 0.02  # [s]


def turn_on(bus: Bus, ids: Sequence[int], watchdog: float) -> None:
    """Torque on with the goal where each servo is now.

    Args:
        bus: The line.
        ids: The servos.
        watchdog: Silence after which a servo stops by itself [s].
    """
    for servo_id in ids:
        bus.write(servo_id, "bus_watchdog", 0)  # one that has tripped takes no goals
        bus.write(servo_id, "goal_position", bus.read(servo_id, "present_position"))
        bus.write(servo_id, "bus_watchdog", from_si("bus_watchdog", watchdog))
    for servo_id in ids:
        bus.write(servo_id, "torque_enable", 1)


def turn_off(bus: Bus, ids: Sequence[int], patience: float) -> None:
    """Torque off, read back, up to five times.

    Args:
        bus: The line.
        ids: The servos.
        patience: How long to wait for their word each time [s].

    Raises:
        TorqueError: It is not certain for some servos; they are named.
    """
    left, why = list(ids), "they do not answer"
    for _ in range(_OFF_ATTEMPTS):
        try:
            left = _still_on(bus, left, patience)
        except BusError as error:
            why = str(error)
        if not left:
            return
    names = "all servos" if len(left) == len(ids) > 1 else ", ".join(bus.label(i) for i in left)
    raise TorqueError(f"torque not confirmed off: cut the power! ({names}: {why})")


def _still_on(bus: Bus, ids: list[int], patience: float) -> list[int]:
    """Tell servos to let go, and give those of which it is not certain."""
    bus.sync_write("torque_enable", dict.fromkeys(ids, 0))
    answers = bus.sync_read(ids, _TORQUE, patience).answers
    off = {i for i, answer in answers.items() if answer.values["torque_enable"] == 0}
    return [i for i in ids if i not in off and not _let_go(bus, i)]


def _let_go(bus: Bus, servo_id: int) -> bool:
    """The same for one servo alone; in a sync read an absent one silences those after it."""
    try:
        bus.write(servo_id, "torque_enable", 0, attempts=1, patience=_SOON)
        return bus.read(servo_id, "torque_enable", attempts=1, patience=_SOON) == 0
    except (NoAnswerError, ServoError):
        return False


def find_servos(path: str, ids: Iterable[int]) -> dict[int, dict[int, int]]:
    """Model numbers of the servos that answer, by baud rate and id; about 0.1 s an id.

    Raises:
        BusError: The port cannot be opened.
    """
    wanted = list(ids)
    found: dict[int, dict[int, int]] = {}
    for baud in sorted(BAUD_CODES, reverse=True):
        with Bus(path, baud) as bus:
            models = {i: model for i in wanted if (model := _model(bus, i)) is not None}
        if models:
            found[baud] = models
    return found


def _model(bus: Bus, servo_id: int) -> int | None:
    try:
        return bus.ping(servo_id, attempts=1, patience=_SOON)[0]
    except NoAnswerError:
        return None
