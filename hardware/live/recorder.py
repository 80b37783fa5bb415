# SPDX-License-Identifier: MIT
"""Writes a run's recording from a thread of its own, so that no device waits for a disk."""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable
from typing import Any

from vtgtsam.recording import RecordingWriter

from .streams import LiveError

_BACKLOG = 60  # messages waiting; above it images are left out

Write = Callable[[RecordingWriter], None]


class Recorder:
    """Takes what is to be recorded from any thread, in the order of the calls; a context manager.

    Args:
        writer: The recording, or None where nothing is recorded.

    Attributes:
        images_dropped: Images left out because the computer could not compress them in time.
    """

    def __init__(self, writer: RecordingWriter | None) -> None:
        self._writer = writer
        self._queue: queue.SimpleQueue[Write | None] = queue.SimpleQueue()
        self._error: Exception | None = None
        self.images_dropped = 0
        self._thread = threading.Thread(target=self._run, name="recorder", daemon=True)
        if writer is not None:
            self._thread.start()

    def __enter__(self) -> Recorder:
        return self

    def __exit__(self, *exception: object) -> None:
        if self._writer is not None:
            self._queue.put(None)
            self._thread.join()
            try:
                self._writer.close()
            except OSError as error:
                self._error = self._error or self._in_words(error)
            if not isinstance(
                exception[1], LiveError
            ):  # else it may be this error that ends the run
                self.check()

    def check(self) -> None:
        """Raise what went wrong while writing, such as a full disk."""
        if self._error is not None:
            raise self._error

    def write(self, method: str, instant_ns: int, *values: Any) -> None:
        """Call a method of the writer, soon, with that instant and these values."""
        if self._writer is not None:
            self._queue.put(lambda writer: getattr(writer, method)(instant_ns / 1e9, *values))

    def write_image(self, method: str, instant_ns: int, image: Any) -> None:
        """The same for an image, unless too much is waiting already."""
        if self._queue.qsize() < _BACKLOG:
            self.write(method, instant_ns, image)
        else:
            self.images_dropped += 1

    def _run(self) -> None:
        assert self._writer is not None
        while (write := self._queue.get()) is not None:
            try:
                write(self._writer)
            except Exception as error:
                self._error = self._in_words(error) if isinstance(error, OSError) else error
                return

    def remarks(self) -> list[str]:
        """What people should hear of the recording; a line each."""
        if not self.images_dropped:
            return []
        return [
            f"{self.images_dropped} images are missing in the recording: the computer could not compress them in time"
        ]

    def _in_words(self, error: OSError) -> LiveError:
        path = self._writer.path if self._writer is not None else "the recording"
        why = error.strerror or str(error)
        return LiveError(
            f"cannot go on writing {path}: {why}. What was written before can be read; make room, or record elsewhere"
        )
