# SPDX-License-Identifier: MIT
"""Rates and latencies of a run, in numbers that people read."""

from __future__ import annotations

from collections import defaultdict, deque

import numpy as np

_WINDOW = 3.0  # [s], over which a rate is taken


class Rate:
    """How fast a counter has grown of late."""

    def __init__(self) -> None:
        self._seen: deque[tuple[float, int]] = deque()

    def update(self, now: float, count: int) -> float:
        """Note a counter's value at a time [s]; its growth over the last 3 s [Hz]."""
        self._seen.append((now, count))
        while self._seen[0][0] < now - _WINDOW:
            self._seen.popleft()
        then, before = self._seen[0]
        return (count - before) / (now - then) if now > then else 0.0


class Latencies:
    """Delays by name."""

    def __init__(self) -> None:
        self._seconds: dict[str, list[float]] = defaultdict(list)

    def add(self, name: str, seconds: float) -> None:
        """Note one."""
        self._seconds[name].append(seconds)

    def percentiles(self, name: str) -> tuple[float, float, float] | None:
        """Median, 95 % and 99 % quantile [s]; None where there are none."""
        if not self._seconds[name]:
            return None
        p50, p95, p99 = np.percentile(self._seconds[name], [50, 95, 99])
        return float(p50), float(p95), float(p99)

    def lines(self) -> list[str]:
        """A table."""
        rows = [f"{'sensor-to-pose latency [ms]':28} {'p50':>6} {'p95':>6} {'p99':>6}"]
        for name in sorted(self._seconds):
            found = self.percentiles(name)
            if found is not None:
                rows.append(f"  {name:26} " + " ".join(f"{1000 * x:6.1f}" for x in found))
        return rows
