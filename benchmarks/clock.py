# SPDX-License-Identifier: MIT
"""One timed call, on a machine that others may be using too. Standard library alone: every environment reads it."""

from __future__ import annotations

import os
import resource
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import TypeVar

T = TypeVar("T")


@dataclass(frozen=True)
class Time:
    """How long a call took.

    Attributes:
        wall: Time on the clock [s].
        cpu: Time its thread was running [s]; less than ``wall`` where another process had the core.
        preempted: Whether the system took the core away meanwhile.
    """

    wall: float
    cpu: float
    preempted: bool


def timed(call: Callable[[], T]) -> tuple[Time, T]:
    """Call and time it."""
    switches = _switches()
    cpu, wall = time.thread_time(), time.perf_counter()
    result = call()
    wall, cpu = time.perf_counter() - wall, time.thread_time() - cpu
    return Time(wall, cpu, _switches() > switches), result


def _switches() -> int:
    return resource.getrusage(resource.RUSAGE_THREAD).ru_nivcsw


def pin(core: int | None = None) -> int:
    """Keep this process, and those it starts, on one core: the last it may use where none is given."""
    core = max(os.sched_getaffinity(0)) if core is None else core
    os.sched_setaffinity(0, {core})
    return core
