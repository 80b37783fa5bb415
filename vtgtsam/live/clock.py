# SPDX-License-Identifier: MIT
"""Instants of a run: whole nanoseconds, as they are recorded."""

from __future__ import annotations

import time
from collections.abc import Callable

Clock = Callable[[], int]  # the present [ns]


class RunClock:
    """Turns monotonic time into nanoseconds since the run began.

    Attributes:
        start: When it began, by the monotonic clock [s].
    """

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        self._clock = clock
        self.start = clock()

    def now_ns(self) -> int:
        """The present."""
        return self.instant_ns(self._clock())

    def instant_ns(self, monotonic: float) -> int:
        """The instant of a monotonic time [s]."""
        return round((monotonic - self.start) * 1e9)
