# SPDX-License-Identifier: MIT
"""Whether a stamp can be right: one that is far from its stream's others is refused, until several say the same."""

from __future__ import annotations

from typing import Literal

FAR_NS = 10**9  # [ns], a stamp further from the last one than this is odd
BELIEVED = 5  # odd ones in a row: it is the clock that has jumped


class StampGuard:
    """Watches the stamps of one stream.

    Attributes:
        odd: Stamps that were refused.
        apart: By how much the last odd one was off [s], positive where it was ahead.
    """

    def __init__(self) -> None:
        self._last: tuple[int, int] | None = None  # stamp and arrival [ns]
        self._candidate: tuple[int, int] | None = None
        self._in_a_row = 0
        self.odd = 0
        self.apart = 0.0

    def restart(self) -> None:
        """Forget the stamps: the next is believed."""
        self._last = self._candidate = None
        self._in_a_row = 0

    def judge(self, stamp_ns: int, arrived_ns: int) -> Literal["fine", "odd", "back"]:
        """What to make of a stamp.

        Args:
            stamp_ns: The stamp [ns].
            arrived_ns: When it came, by a clock that does not jump [ns].

        Returns:
            "fine"; "odd": to be refused; "back": the clock of the stamps has gone back, and all that was known is of
            a time to come.
        """
        if self._last is None or _follows(self._last, stamp_ns, arrived_ns):
            newest = stamp_ns if self._last is None else max(stamp_ns, self._last[0])
            self._last, self._candidate, self._in_a_row = (newest, arrived_ns), None, 0
            return "fine"
        candidate = self._candidate
        same = candidate is not None and _follows(candidate, stamp_ns, arrived_ns)
        self._candidate = (stamp_ns, arrived_ns)
        self._in_a_row = self._in_a_row + 1 if same else 1
        if self._in_a_row < BELIEVED:
            self.odd += 1
            self.apart = (stamp_ns - self._last[0]) / 1e9
            return "odd"
        back = stamp_ns < self._last[0]
        self._last, self._candidate, self._in_a_row = (stamp_ns, arrived_ns), None, 0
        return "back" if back else "fine"


def _follows(last: tuple[int, int], stamp_ns: int, arrived_ns: int) -> bool:
    """Whether a stamp is near the last one, a pause of the stream granted."""
    pause_ns = max(0, arrived_ns - last[1])
    return -FAR_NS <= stamp_ns - last[0] <= FAR_NS + pause_ns
