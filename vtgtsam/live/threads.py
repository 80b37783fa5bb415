# SPDX-License-Identifier: MIT
"""Threads that tick at a steady rate and end together."""

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


_JOIN = 5.0  # [s]


class Workers:
    """The threads of a run; a context manager that stops them on the way out.

    Attributes:
        stop: Set when they are to end.
    """

    def __init__(self) -> None:
        self.stop = threading.Event()
        self._threads: list[threading.Thread] = []
        self._error: BaseException | None = None

    def __enter__(self) -> Workers:
        return self

    def __exit__(self, *exception: object) -> None:
        self.end()

    def start(self, name: str, work: Callable[[threading.Event], None]) -> None:
        """Run ``work(stop)`` in a thread; it returns when ``stop`` is set or its work is done."""
        thread = threading.Thread(target=self._run, args=(work,), name=name, daemon=True)
        self._threads.append(thread)
        thread.start()

    def check(self) -> None:
        """Raise the first error of any thread."""
        if self._error is not None:
            raise self._error

    def end(self) -> None:
        """Stop all and wait for them; one that hangs is left behind, it is a daemon."""
        self.stop.set()
        for thread in self._threads:
            thread.join(_JOIN)

    def _run(self, work: Callable[[threading.Event], None]) -> None:
        try:
            work(self.stop)
        except BaseException as error:
            if self._error is None:
                self._error = error
            self.stop.set()
