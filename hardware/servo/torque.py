# SPDX-License-Identifier: MIT
"""Torque on without a jump, and torque off for certain."""

from __future__ import annotations

from collections.abc import Sequence

from .bus import Bus
from .codec import Block, from_si
from .errors import BusError, NoAnswerError, ServoError, TorqueError

_TORQUE = Block(["torque_enable"])
_ATTEMPTS = 5
_PATIENCE = 0.02  # [s]


def turn_on(bus: Bus, ids: Sequence[int], watchdog: float) -> None:
    """Torque on with the goal where each servo is now.

    Args:
        bus: The line.
        ids: The servos.
        watchdog: Silence after which a servo stops by itself [s].
    """
    for servo_id in ids:
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
    for _ in range(_ATTEMPTS):
        try:
            left = _still_on(bus, left, patience)
        except BusError as error:
            why = str(error)
        if not left:
            return
    names = ", ".join(bus.label(i) for i in left)
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
        bus.write(servo_id, "torque_enable", 0, attempts=1, patience=_PATIENCE)
        return bus.read(servo_id, "torque_enable", attempts=1, patience=_PATIENCE) == 0
    except (NoAnswerError, ServoError):
        return False
