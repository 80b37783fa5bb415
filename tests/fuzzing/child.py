# SPDX-License-Identifier: MIT
"""One input in a process of its own: what it may take, and what became of it."""

from __future__ import annotations

import faulthandler
import os
import resource
import select
import signal
import sys
import time
import traceback
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

SECONDS = 10  # of processor time: other programs run as well
PATIENCE = 90.0  # [s] by the clock, for what waits
BYTES = 2 << 30  # that a process may hold
_SAID = 20_000  # [characters] of its output that are kept


@dataclass(frozen=True)
class Outcome:
    """What became of one input.

    Attributes:
        problem: What is wrong, or "" where all is well.
        said: What was printed.
    """

    problem: str
    said: str


def run(work: Callable[[], str], folder: Path) -> Outcome:
    """Call ``work`` in a copy of this process; it answers with what is wrong, or "".

    Args:
        work: The function; what it prints is kept.
        folder: Where its output goes for the time.
    """
    log = folder / "said.txt"
    sys.stdout.flush()
    sys.stderr.flush()
    read, write = os.pipe()
    process = os.fork()
    if process == 0:
        os.close(read)
        _child(work, log, write)
    os.close(write)
    problem = _wait(process, read)
    os.close(read)
    return Outcome(problem, log.read_text(encoding="utf-8", errors="replace")[:_SAID])


def _child(work: Callable[[], str], log: Path, answer: int) -> None:
    """Never returns."""
    try:
        os.setsid()
        faulthandler.disable()  # what a signal means is told by the parent
        limit = _address_space() + 3 * BYTES // 2
        resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
        resource.setrlimit(resource.RLIMIT_CPU, (SECONDS + _spent(), SECONDS + _spent()))
        resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
        output = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
        os.dup2(output, 1)
        os.dup2(output, 2)
        problem = work()
    except BaseException:
        problem = "an exception that is none of ours: " + traceback.format_exc()
    sys.stdout.flush()
    sys.stderr.flush()
    os.write(answer, problem.encode()[-4000:])
    os._exit(0)


def _spent() -> int:
    """Processor time of this process so far [s]."""
    return round(time.process_time())


def _address_space() -> int:
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    return pages * resource.getpagesize()


def _wait(process: int, read: int) -> str:
    start = time.monotonic()
    ready, _, _ = select.select([read], [], [], PATIENCE)
    if not ready:
        os.killpg(process, signal.SIGKILL)
    answer = os.read(read, 1 << 16).decode(errors="replace") if ready else ""
    _, status, usage = os.wait4(process, 0)
    if not ready:
        return f"it hangs: no answer after {time.monotonic() - start:.0f} s"
    if os.WIFSIGNALED(status) and usage.ru_utime + usage.ru_stime > SECONDS - 1:
        return f"it hangs: {SECONDS} s of processor time are not enough"
    if os.WIFSIGNALED(status):
        return f"it ended by signal {signal.Signals(os.WTERMSIG(status)).name}"
    if usage.ru_maxrss * 1024 > BYTES:
        return f"it held {usage.ru_maxrss / 1e6:.1f} GB"
    return answer
