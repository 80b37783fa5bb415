# SPDX-License-Identifier: MIT
"""What may happen to a grasp once it holds: the object is pushed and slips in the hand, or the hand lets it fall.

Both are physics: a force on the object until it has moved, or fingers that open while the wrist turns on. When it truly
happened is judged afterwards, by where the object was in the hand and what it touched.
"""

from __future__ import annotations

from typing import Protocol

import numpy as np

from .world import World

EVENTS = ("slip", "drop")
BEGIN = 10.5  # [s], the turn has ended
LONGER = 1.5  # [s], by which a sequence with an event goes on after ``DURATION``

FORCE_RATE = 40.0  # [N/s], a push grows until the object gives way
PUSHED = 0.010  # [m], way in the hand after which it ends
SLIP, SLIP_WITHIN = 0.004, 0.5  # [m], [s], a motion in the hand that counts as a slip

OPEN_WITHIN = 0.4  # [s], fingers open
TURNED_OVER = np.deg2rad(150.0)  # the wrist's angle at which an open hand holds nothing ...
TURN_WITHIN = 1.0  # [s], ... and until it is there


class Happening(Protocol):
    """Changes what a hand is told, or what pulls at the object."""

    def command(self, time: float, joints: np.ndarray, wrist: float) -> tuple[np.ndarray, float]:
        """The joints' (J,) and the wrist's goals [rad] instead of these."""
        ...

    def act(self, time: float) -> None:
        """Push the object, or let it be, in the next time step."""
        ...


def happening(event: str, world: World) -> Happening:
    """The event of that name in a world."""
    if event not in EVENTS:
        raise ValueError(f"event must be one of {', '.join(EVENTS)}, got {event!r}")
    return Push(world) if event == "slip" else Release(world)


class Push:
    """Pushes the object along the palm, away from the wrist, until it has moved in the hand."""

    def __init__(self, world: World) -> None:
        self._world = world
        self._place_h: np.ndarray | None = None  # of the object when the push begins
        self._done = False

    def command(self, time: float, joints: np.ndarray, wrist: float) -> tuple[np.ndarray, float]:
        """As they are: the hand goes on closing."""
        return joints, wrist

    def act(self, time: float) -> None:
        """Push a little harder than before."""
        world = self._world
        if time < BEGIN or self._done:
            world.push(np.zeros(3))
            return
        center_h = place_in_hand(world.T_wh(), world.T_wo(), world.obj.center)
        if self._place_h is None:
            self._place_h = center_h
        self._done = bool(np.linalg.norm(center_h - self._place_h) > PUSHED)
        forwards = world.T_wh()[:3, :3] @ world.description.palm.level().T[:, 0]
        world.push(FORCE_RATE * (time - BEGIN) * forwards)


class Release:
    """Opens the fingers and turns the hand over."""

    def __init__(self, world: World) -> None:
        self._open = world.start

    def command(self, time: float, joints: np.ndarray, wrist: float) -> tuple[np.ndarray, float]:
        """On the way to the open hand, palm down."""
        opened = np.clip((time - BEGIN) / OPEN_WITHIN, 0.0, 1.0)
        turned = np.clip((time - BEGIN) / TURN_WITHIN, 0.0, 1.0)
        return joints + opened * (self._open - joints), wrist + turned * (TURNED_OVER - wrist)

    def act(self, time: float) -> None:
        """Nothing pulls but its weight."""


def place_in_hand(T_wh: np.ndarray, T_wo: np.ndarray, center_o: np.ndarray) -> np.ndarray:
    """Where the object's centre is in the hand [m], shape (..., 3)."""
    place_w = T_wo[..., :3, :3] @ center_o + T_wo[..., :3, 3]
    away = place_w - T_wh[..., :3, 3]
    found: np.ndarray = np.einsum("...ji,...j->...i", T_wh[..., :3, :3], away)
    return found


def instant(
    event: str,
    time: np.ndarray,
    T_wh: np.ndarray,
    T_wo: np.ndarray,
    contacts: np.ndarray,
    center_o: np.ndarray,
) -> float | None:
    """When the event truly happened [s]; None where it did not.

    A slip: the object's centre is first more than ``SLIP`` from where it was in the hand ``SLIP_WITHIN`` ago. A drop:
    no pad touches it any more, until the end.

    Args:
        event: One of ``EVENTS``.
        time: Instants [s], shape (T,).
        T_wh: The hand, shape (T, 4, 4).
        T_wo: The object, shape (T, 4, 4).
        contacts: Whether it touches each pad, shape (T, K).
        center_o: The object's centre [m], shape (3,).
    """
    if event == "drop":
        touched = np.flatnonzero(contacts.any(axis=1))
        last = int(touched[-1]) if len(touched) else -1
        return float(time[last + 1]) if last + 1 < len(time) else None
    place = place_in_hand(T_wh, T_wo, center_o)
    before = np.searchsorted(time, time - SLIP_WITHIN)
    way = np.linalg.norm(place - place[before], axis=1)
    slipped = np.flatnonzero((way > SLIP) & (time >= BEGIN))
    return float(time[slipped[0]]) if len(slipped) else None
