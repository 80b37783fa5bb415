# SPDX-License-Identifier: MIT
"""How long things took, by name, of the last few thousand frames."""

from __future__ import annotations

from collections import deque

import numpy as np

KEPT = 4096


class Latencies:
    """Delays by name."""

    def __init__(self) -> None:
        self._seconds: dict[str, deque[float]] = {}

    def add(self, name: str, seconds: float) -> None:
        """Note one."""
        self._seconds.setdefault(name, deque(maxlen=KEPT)).append(seconds)

    def percentiles(self, name: str) -> tuple[float, float, float] | None:
        """Median, 95 % and 99 % quantile [s]; None where there are none."""
        if name not in self._seconds:
            return None
        p50, p95, p99 = np.percentile(list(self._seconds[name]), [50, 95, 99])
        return float(p50), float(p95), float(p99)

    def lines(self) -> list[str]:
        """A table."""
        rows = [f"{'sensor-to-pose latency [ms]':28} {'p50':>6} {'p95':>6} {'p99':>6}"]
        for name in sorted(self._seconds):
            found = self.percentiles(name)
            if found is not None:
                rows.append(f"  {name:26} " + " ".join(f"{1000 * x:6.1f}" for x in found))
        return rows
