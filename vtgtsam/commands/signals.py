# SPDX-License-Identifier: MIT
"""SIGTERM and SIGHUP as a way out of ``with`` blocks.

Python ends on the spot when they come, and leaves its temporary files. Here its blocks are left first; then the
process ends by the signal after all, so that who sent it sees that. A second one ends it on the spot.
"""

from __future__ import annotations

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

SIGNALS = tuple(getattr(signal, name) for name in ("SIGTERM", "SIGHUP") if hasattr(signal, name))


class _Ended(SystemExit):
    """A signal came."""

    def __init__(self, number: int) -> None:
        super().__init__(128 + number)  # as shells count
        self.number = number


@contextmanager
def blocks_left_first() -> Iterator[None]:
    """Leave all blocks inside when SIGTERM or SIGHUP comes, and end by it.

    A signal that is ignored (``nohup``) or has a handler already keeps it. Only in the main thread, as always
    with signals.
    """

    def leave(number: int, frame: FrameType | None) -> None:
        signal.signal(number, signal.SIG_DFL)
        raise _Ended(number)

    if threading.current_thread() is not threading.main_thread():
        yield
        return
    handled = [number for number in SIGNALS if signal.getsignal(number) is signal.SIG_DFL]
    for number in handled:
        signal.signal(number, leave)
    try:
        yield
    except _Ended as ended:
        os.kill(os.getpid(), ended.number)  # which ends it by default now
        raise
    finally:
        for number in handled:
            signal.signal(number, signal.SIG_DFL)
