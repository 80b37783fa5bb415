# SPDX-License-Identifier: MIT
"""Whether a servo made its answer after it was asked, by its own clock.

When a USB hub stalls, the answers to one cycle's question may arrive in the next cycle, and look
like its answers. From then on each position would be a cycle too old, unnoticed. But every servo
counts milliseconds (Realtime Tick, 0..32767, then from 0 again). Between two answers this count must
have advanced as far as our own clock, give or take what we do not know: each answer was made
somewhere between the beginning and the end of its transaction.

The same comparison shows a servo that has restarted by itself, as after a dip of its supply; it then
holds no torque and has lost its gains and its current cap.
"""

from __future__ import annotations

from enum import Enum

_TURN = 32.768  # [s], after which the tick begins anew
_SLACK = 0.003  # [s], rounding of ticks and time between measuring and stamping
_DRIFT = 0.05  # of the time between; an uncalibrated oscillator is within 3 %
_LONGEST_LAG = 1.0  # [s], an answer cannot lie on the way for longer
_FORGET = 10.0  # [s], after which the drift says nothing any more


class Freshness(Enum):
    """What the servo's clock says about an answer."""

    FRESH = "fresh"
    STALE = "made before it was asked for"
    RESTARTED = "made after a restart"


class ServoClock:
    """One servo's clock, compared with ours from answer to answer."""

    def __init__(self) -> None:
        self._last: tuple[int, float, float] | None = None

    def forget(self) -> None:
        """Start anew, as after a reboot we asked for."""
        self._last = None

    def check(self, tick: int, start: float, end: float) -> Freshness:
        """Judge an answer; a fresh one is what the next is compared with.

        Args:
            tick: The servo's Realtime Tick in its answer [ms].
            start: Our time when the question went out [s].
            end: Our time when the last answer had come [s].
        """
        freshness = self._judge(tick, start, end)
        if freshness is Freshness.FRESH:
            self._last = (tick, start, end)
        return freshness

    def _judge(self, tick: int, start: float, end: float) -> Freshness:
        if self._last is None or start - self._last[2] > _FORGET:
            return Freshness.FRESH
        last_tick, last_start, last_end = self._last
        shortest, longest = start - last_end, end - last_start
        slack = _SLACK + _DRIFT * longest
        middle = (shortest + longest) / 2
        advance = (tick - last_tick) / 1000
        lag = (middle - advance + _TURN / 2) % _TURN - _TURN / 2
        if abs(lag) <= (longest - shortest) / 2 + slack:
            return Freshness.FRESH
        return Freshness.STALE if 0 < lag < _LONGEST_LAG else Freshness.RESTARTED
