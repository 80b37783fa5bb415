# SPDX-License-Identifier: MIT
"""Signals as a way out of ``with`` blocks.

Python leaves its blocks when Ctrl-C comes, but SIGTERM and SIGHUP end it on the spot: a hand would
keep its torque until its watchdogs act.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


@contextmanager
def stop_on_signals() -> Iterator[None]:
    """The first SIGINT raises KeyboardInterrupt, the first SIGTERM or SIGHUP SystemExit.

    Later ones are ignored until the block ends, so that they cannot interrupt the way out. A hangup that is
    ignored (``nohup``) stays ignored. Only in the main thread, as always with signals.
    """

    def stop(number: int, frame: FrameType | None) -> None:
        for other in SIGNALS:
            signal.signal(other, signal.SIG_IGN)
        raise KeyboardInterrupt if number == signal.SIGINT else SystemExit(128 + number)

    handled = [n for n in SIGNALS if n != signal.SIGHUP or signal.getsignal(n) != signal.SIG_IGN]
    before = {number: signal.signal(number, stop) for number in handled}
    try:
        yield
    finally:
        for number, handler in before.items():
            signal.signal(number, handler)
