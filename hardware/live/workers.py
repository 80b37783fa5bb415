# SPDX-License-Identifier: MIT
"""Threads that end together: when one fails, all stop and the main thread hears why."""

from __future__ import annotations

import threading
from collections.abc import Callable

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
