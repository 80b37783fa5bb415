# SPDX-License-Identifier: MIT
"""How fast a counter grows."""

from __future__ import annotations

from collections import deque

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
