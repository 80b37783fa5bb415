# SPDX-License-Identifier: MIT
"""A worker process ends with the process that started it, whatever ends that one.

Linux sends the worker a signal; elsewhere a thread of the worker looks whether its parent is still the same.
"""

from __future__ import annotations

import ctypes
import os
import signal
import sys
import threading
import time

_PR_SET_PDEATHSIG = 1  # from <linux/prctl.h>
_PERIOD = 0.5  # [s]


def end_with_parent(parent: int) -> None:
    """Called in a worker: end it when the process ``parent`` ends, which started it."""
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
    elif sys.platform != "win32":
        threading.Thread(target=_watch, args=(parent,), daemon=True).start()
    if _is_orphan(parent):  # it ended before
        os._exit(1)


def _watch(parent: int) -> None:
    while not _is_orphan(parent):
        time.sleep(_PERIOD)
    os._exit(1)


def _is_orphan(parent: int) -> bool:
    return sys.platform != "win32" and os.getppid() != parent
