# SPDX-License-Identifier: MIT
"""A steady rate: deadlines that lie on a grid, however long the work between them takes."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable


class Ticker:
    """Ticks at absolute deadlines of the monotonic clock.

    A tick that comes late does not shift those after it, and deadlines that have passed altogether
    are counted and left out: they are never made up for by several ticks at once.

    Attributes:
        period: Between deadlines [s].
        ticks: Ticks so far.
        missed: Deadlines left out so far.
    """

    def __init__(self, rate: float, clock: Callable[[], float] = time.monotonic) -> None:
        """Make the first deadline now.

        Args:
            rate: Ticks a second [Hz].
            clock: Monotonic time [s].
        """
        if not rate > 0:
            raise ValueError(f"rate must be above 0 Hz, got {rate}")
        self.period = 1.0 / rate
        self.ticks = 0
        self.missed = 0
        self._clock = clock
        self._start = clock()
        self._next = 0  # deadlines are start + n period: sums of periods would drift

    def remaining(self) -> float:
        """Time until the next deadline [s], 0 where it has come."""
        return max(0.0, self._start + self._next * self.period - self._clock())

    def take(self) -> None:
        """Take the deadline that has come; those after it that have passed as well are missed."""
        due = int((self._clock() - self._start) / self.period)
        self.missed += max(0, due - self._next)
        self._next = max(due, self._next) + 1
        self.ticks += 1

    def wait(self, stop: threading.Event) -> bool:
        """Wait for the next deadline. False, at once, when ``stop`` is set."""
        if stop.wait(self.remaining()):
            return False
        self.take()
        return True
