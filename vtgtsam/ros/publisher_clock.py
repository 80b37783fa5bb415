# SPDX-License-Identifier: MIT
"""The present by the clock of the stamps, for messages that have none.

Publishers on this computer stamp by its clock, and then the present is this computer's. A bag that is played without
simulated time, or a robot whose clock is not synchronised, stamps by another one: the present is then as far from ours
as the stamps of the joints are, those that took least time.
"""

from __future__ import annotations

from collections import deque

from ..live.clock import Clock

OTHER_NS = 10**9  # [ns], stamps that are further from this clock are by another one
_KEPT = 100  # stamps


class PublisherClock:
    """Tells the present by the clock of the stamps.

    Args:
        now: The present by this computer's clock, or the simulated one [ns].

    Attributes:
        offset_ns: What that clock is ahead of this one [ns]; 0 where they are one.
    """

    def __init__(self, now: Clock) -> None:
        self._now = now
        self._ahead: deque[int] = deque(maxlen=_KEPT)
        self.offset_ns = 0

    def note(self, stamp_ns: int) -> None:
        """Hear a stamp that is believed, as its message comes."""
        self._ahead.append(stamp_ns - self._now())
        ahead = max(self._ahead)
        self.offset_ns = ahead if abs(ahead) > OTHER_NS else 0

    def restart(self) -> None:
        """Forget the stamps: a clock has jumped."""
        self._ahead.clear()

    def now_ns(self) -> int:
        """The present."""
        return self._now() + self.offset_ns
