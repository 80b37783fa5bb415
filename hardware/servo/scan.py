# SPDX-License-Identifier: MIT
"""Which servos answer at which rate, where it is not known."""

from __future__ import annotations

from collections.abc import Iterable

from .bus import Bus
from .errors import NoAnswerError
from .table import BAUD_CODES

_PATIENCE = 0.02  # [s]


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
        return bus.ping(servo_id, attempts=1, patience=_PATIENCE)[0]
    except NoAnswerError:
        return None
