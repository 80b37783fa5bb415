# SPDX-License-Identifier: MIT
"""Writes a run's recordings from a thread of its own, so that no device waits for a disk."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any

from ..exceptions import LiveError
from ..recording import RecordingWriter

_BACKLOG = 60  # messages waiting; above it images are left out

Order = Callable[[], None]


class Recorder:
    """Takes what is to be recorded from any thread, in the order of the calls; a context manager.

    Args:
        writer: The recording, or None where nothing is recorded yet.
        another: Opens one more, where several are to be made.

    Attributes:
        path: The file that is written, or was last; None where there is none.
        images_dropped: Images left out because the computer could not compress them in time.
    """

    def __init__(
        self, writer: RecordingWriter | None, another: Callable[[], RecordingWriter] | None = None
    ) -> None:
        self._writer = writer
        self._another = another
        self._on = writer is not None
        self._queue: queue.SimpleQueue[Order | None] = queue.SimpleQueue()
        self._error: Exception | None = None
        self.path: Path | None = None if writer is None else writer.path
        self.images_dropped = 0
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        if writer is not None or another is not None:
            self._thread.start()

    def __enter__(self) -> Recorder:
        return self

    def __exit__(self, *exception: object) -> None:
        if self._thread.is_alive():
            self._queue.put(None)
            self._thread.join()
        try:
            self._close()
        except OSError as error:
            self._error = self._error or self._in_words(error)
        if not isinstance(exception[1], LiveError):  # else it may be this error that ends the run
            self.check()

    @property
    def on(self) -> bool:
        """Whether what comes is recorded."""
        return self._on and self._error is None

    def check(self) -> None:
        """Raise what went wrong while writing, such as a full disk."""
        if self._error is not None:
            raise self._error

    def begin_another(self, always: bool = False) -> None:
        """What comes from here on goes to a recording of its own.

        Args:
            always: Whether to begin one where nothing is recorded so far.
        """
        if self._another is not None and (always or self.on):
            self._error = None
            self._on = True
            self._queue.put(self._open)

    def end(self) -> None:
        """What comes from here on is not recorded."""
        self._on = False
        self._queue.put(self._close)

    def write(
        self, method: str, instant_ns: int, *values: Any, received_ns: int | None = None
    ) -> None:
        """Call a method of the writer, soon, with that instant and these values.

        Args:
            method: Its name.
            instant_ns: The instant that the values belong to [ns].
            *values: What else it takes.
            received_ns: When they became known [ns], ``instant_ns`` where None.
        """
        if not self._on:
            return
        known = {} if received_ns is None else {"received": _seconds(received_ns)}

        def order() -> None:
            getattr(self._writer, method)(_seconds(instant_ns), *values, **known)

        self._queue.put(order)

    def write_image(self, method: str, instant_ns: int, image: Any) -> None:
        """The same for an image, unless too much is waiting already."""
        if self._queue.qsize() < _BACKLOG:
            self.write(method, instant_ns, image)
        else:
            self.images_dropped += 1

    def remarks(self) -> list[str]:
        """What people should hear of the recording; a line each."""
        if not self.images_dropped:
            return []
        return [
            f"{self.images_dropped} images are missing in the recording: the computer could not compress them in time"
        ]

    def _run(self) -> None:
        while (order := self._queue.get()) is not None:
            if self._error is not None and order != self._open:
                continue
            try:
                order()
            except Exception as error:
                self._error = self._in_words(error) if isinstance(error, OSError) else error

    def _open(self) -> None:
        self._close()
        assert self._another is not None
        self._writer = self._another()
        self.path = self._writer.path

    def _close(self) -> None:
        writer, self._writer = self._writer, None
        if writer is not None:
            writer.close()

    def _in_words(self, error: OSError) -> LiveError:
        where = error.filename or self.path or "the recording"
        return LiveError(
            f"cannot go on writing {where}: {error.strerror or error}. What was written before can be read; make "
            "room, or record elsewhere"
        )


def _seconds(instant_ns: int) -> Fraction:
    """An instant [s] to the nanosecond, which a float has no room for since 2001."""
    return Fraction(instant_ns, 10**9)
