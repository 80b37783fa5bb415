# SPDX-License-Identifier: MIT
"""For how long something has been so."""

from __future__ import annotations


class Lasting:
    """Tells whether a condition has held without a break for some time.

    Args:
        duration: How long [s].
    """

    def __init__(self, duration: float) -> None:
        self._duration = duration
        self._since: float | None = None

    def holds(self, time: float, condition: bool) -> bool:
        """Whether the condition has now, at an instant [s], held for long enough."""
        if not condition:
            self._since = None
            return False
        if self._since is None:
            self._since = time
        return time - self._since >= self._duration
